// OpenImageIO's readers of picture files. They are a module of their own, loaded at the first picture that is
// read: OpenImageIO brings 250 shared libraries, and loading them takes longer than many a command.
#pragma once

#include "format/picture/image.h"

namespace selvedge {

/// The table that the module exports (module/openimageio.cpp).
struct OpenImageIo {
  /// Reads the bytes of a file by the reader of that name, as decode_image() says.
  Result<Image> (*read)(const char* format, std::span<const std::uint8_t> bytes, const std::string& name,
                        Transfer transfer, const ImageLimits& limits, int halvings);
};

/// Loads the module by the RUNPATH of the program or library; IMAGE_UNREADABLE if it cannot be loaded.
Result<const OpenImageIo*> load_openimageio();

}  // namespace selvedge
