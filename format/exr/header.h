// The headers of an OpenEXR file, without OpenEXR: hostile bytes meet no code but our own. What is not read
// (deep data, rip maps, windows off the origin, sub-sampled or unsigned channels) is refused here as well.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "format/exr/exr.h"
#include "format/exr/source.h"

namespace selvedge {

struct ExrHeader {
  std::vector<ExrPart> parts;
  bool multipart = false;  ///< chunks then begin with the number of their part
  std::uint64_t end = 0;   ///< the first byte after the headers: the offset tables begin
};

/// EXR_MALFORMED where a rule of the format is broken, EXR_UNSUPPORTED for a feature that is not read,
/// FILE_DAMAGED where the file ends within its headers, FILE_TOO_LARGE beyond a limit.
Result<ExrHeader> read_exr_header(ExrSource& source, const std::string& file, const ExrLimits& limits);

}  // namespace selvedge
