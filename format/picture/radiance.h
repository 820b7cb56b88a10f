// Radiance pictures (.hdr, .pic) read by the project's own code: OpenImageIO ignores EXPOSURE, COLORCORR and
// the order of scanlines, and reads neither the first run lengths (those before 1991) nor XYZE.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "format/picture/image.h"

namespace selvedge {

/// Decodes a file whose first bytes are "#?": the top row first, divided by EXPOSURE and COLORCORR, with the
/// primaries of its header; a missing FORMAT is RGBE. IMAGE_UNREADABLE for other bytes, FILE_TOO_LARGE
/// beyond `limits`.
Result<Image> read_radiance(std::span<const std::uint8_t> bytes, const std::string& name,
                            const ImageLimits& limits);

}  // namespace selvedge
