// The whole structure of an OpenEXR file, checked before a pixel is decoded: headers, offset tables and the
// head of every chunk, by code that trusts no byte of them. OpenEXR's C++ reader searches the file for the
// chunks of a broken table, for minutes if need be, and accepts a file that is cut short; its C core (3.1.5)
// drops repeated attributes and sorts channels, so that the first of two values and the pixels of another
// channel would be read (docs/architecture.md).
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
  std::uint64_t end = 0;   ///< the first byte after the headers: the offset tables begin
};

/// The headers (header.cpp). Features that are not read (deep data, rip maps, windows off the origin,
/// sub-sampled or unsigned channels) are refused here as well. EXR_MALFORMED where a rule of the format is
/// broken, EXR_UNSUPPORTED for a feature that is not read, FILE_DAMAGED where the file ends within its
/// headers, FILE_TOO_LARGE beyond a limit.
Result<ExrHeader> read_exr_header(const InputFile& source, const std::string& file, const ExrLimits& limits);

struct ExrScan {
  std::vector<ExrPart> parts;
  std::vector<std::vector<ExrChunk>> chunks;  ///< per part, in the order of exr_chunks()
  std::uint64_t bytes = 0;                    ///< of headers, tables and heads of chunks
};

/// Besides the codes of read_exr_header(): FILE_DAMAGED where a table or a chunk is not as the headers say or
/// reaches beyond the file, FILE_TOO_LARGE where a chunk would grow beyond ExrLimits::expansion.
Result<ExrScan> scan_exr(const InputFile& source, const std::string& file, const ExrLimits& limits);

}  // namespace selvedge
