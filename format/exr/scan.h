// Validates the structure of an OpenEXR file before a pixel is decoded: headers, offset tables and the header
// of every chunk. OpenEXR's C++ reader searches the file for the chunks of a broken table, which can take
// minutes, and accepts a truncated file; its C core (3.1.5) drops repeated attributes and sorts channels, so
// that a wrong value or the pixels of another channel would be read (docs/architecture.md).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "format/base/input_file.h"
#include "format/exr/exr.h"
#include "format/exr/layout.h"

namespace selvedge {

struct ExrHeader {
  std::vector<ExrPart> parts;
  bool multipart = false;  ///< chunks then begin with the number of their part
  std::uint64_t end = 0;   ///< the first byte after the headers, where the offset tables begin
};

/// Reads the headers (header.cpp). EXR_MALFORMED if they break a rule of the format, EXR_UNSUPPORTED for
/// features that are not read (deep data, rip maps, windows off the origin, sub-sampled or unsigned
/// channels), FILE_DAMAGED if the file ends within its headers, FILE_TOO_LARGE beyond a limit.
Result<ExrHeader> read_exr_header(const InputFile& source, const std::string& file, const ExrLimits& limits);

struct ExrScan {
  std::vector<ExrPart> parts;
  std::vector<std::vector<ExrChunk>> chunks;  ///< per part, in the order of exr_chunks()
  std::uint64_t bytes = 0;                    ///< size of headers, tables and headers of chunks
};

/// Errors are those of read_exr_header(), FILE_DAMAGED if a table or a chunk contradicts the headers or
/// reaches beyond the file, and FILE_TOO_LARGE if a chunk would expand beyond ExrLimits::expansion.
Result<ExrScan> scan_exr(const InputFile& source, const std::string& file, const ExrLimits& limits);

}  // namespace selvedge
