// The functions of OpenImageIO that the project uses: picture files. They are a module of their own,
// which is loaded at the first picture: OpenImageIO brings 250 shared libraries, and loading them takes
// longer than many a command.
#pragma once

#include "format/picture/image.h"

namespace selvedge {

/// The table that the module exports (module/openimageio.cpp).
struct OpenImageIo {
  /// Reads the bytes of a file by the reader of that name, as decode_image() says.
  Result<Image> (*read)(const char* format, std::span<const std::uint8_t> bytes, const std::string& name,
                        Transfer transfer, const ImageLimits& limits, int halvings);
  /// A PNG file with the size and channels of `image` and the values `bytes`.
  Result<std::vector<std::uint8_t>> (*encode_png)(const Image& image, std::span<const std::uint8_t> bytes,
                                                  Transfer transfer);
};

/// Loads the module by the RUNPATH of the program or library. `code` is the error if it cannot be loaded.
Result<const OpenImageIo*> load_openimageio(Code code);

}  // namespace selvedge
