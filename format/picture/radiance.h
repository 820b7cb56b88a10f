// Radiance pictures (.hdr), as environments come, read without OpenImageIO, which takes 0.2 s and 100 MB to
// load.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "format/picture/image.h"

namespace selvedge {

/// Decodes a file of RGBE whose first bytes are "#?" and whose rows come from the top, left to right, flat or
/// in runs of components; divided by its EXPOSURE and COLORCORR, of its PRIMARIES. IMAGE_UNREADABLE for other
/// bytes, FILE_TOO_LARGE beyond `limits`.
Result<Image> decode_hdr(std::span<const std::uint8_t> bytes, const std::string& name,
                         const ImageLimits& limits);

}  // namespace selvedge
