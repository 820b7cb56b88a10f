// The whole structure of an OpenEXR file, checked before a pixel is decoded: headers, offset tables and the
// head of every chunk. OpenEXR's own reader mends broken tables by searching the file, for minutes if need
// be, and takes a file that is cut short for whole; this one says no.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "format/exr/exr.h"
#include "format/exr/layout.h"
#include "format/exr/source.h"

namespace selvedge {

/// A chunk, and where its packed pixels lie in the file.
struct ExrPlacedChunk {
  ExrChunk chunk;
  std::uint32_t packed_bytes = 0;
  std::uint64_t offset = 0;
};

struct ExrScan {
  std::vector<ExrPart> parts;
  std::vector<std::vector<ExrPlacedChunk>> chunks;  ///< per part, in the order of exr_chunks()
};

/// Besides the codes of read_exr_header(): FILE_DAMAGED where a table or a chunk is not as the headers say or
/// reaches beyond the file, FILE_TOO_LARGE where a chunk would grow beyond ExrLimits::expansion.
Result<ExrScan> scan_exr(ExrSource& source, const std::string& file, const ExrLimits& limits);

}  // namespace selvedge
