// The functions of OpenImageIO that the project uses: picture files and text. They are in a module that is
// loaded at the first picture, because OpenImageIO brings 250 shared libraries, and loading them takes longer
// than most commands.
#pragma once

#include <array>

#include "format/picture/image.h"

namespace selvedge {

/// The table that the module exports (module/openimageio.cpp).
struct OpenImageIo {
  /// Reads `bytes`, or if they are empty the file `name`.
  Result<Image> (*read)(const std::string& name, std::span<const std::uint8_t> bytes, Transfer transfer,
                        const ImageLimits& limits);
  /// A PNG file with the size and channels of `image` and the values `bytes`.
  Result<std::vector<std::uint8_t>> (*encode_png)(const Image& image, std::span<const std::uint8_t> bytes,
                                                  Transfer transfer);
  Result<std::vector<std::uint8_t>> (*encode_exr)(const Image& image);
  /// Width of the inked part of a text, pixels. `size`: pixels; `font`: path of a TrueType file.
  int (*text_width)(const std::string& text, int size, const std::string& font);
  /// Draws over a picture of three channels; (x, y) is the left end of the baseline.
  Result<void> (*draw_text)(Image& image, int x, int y, const std::string& text, int size,
                            const std::string& font, const std::array<float, 3>& colour);
};

/// Loads the module by the RUNPATH of the program or library. `code` is the error if it cannot be loaded.
Result<const OpenImageIo*> load_openimageio(Code code);

}  // namespace selvedge
