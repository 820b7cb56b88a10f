// The function of OpenImageIO that the project uses: it reads pictures. It is a module of its own,
// which is loaded at the first picture: OpenImageIO brings 250 shared libraries, and loading them takes
// longer than many a command.
#pragma once

#include "format/picture/image.h"

namespace selvedge {

/// The table that the module exports (module/openimageio.cpp).
struct OpenImageIo {
  /// Reads the bytes of a file by the reader of that name, as decode_levels() says.
  Result<std::vector<Image>> (*read)(const char* format, std::span<const std::uint8_t> bytes,
                                     const std::string& name, Transfer transfer, const ImageLimits& limits,
                                     std::span<const int> halvings);
};

}  // namespace selvedge
