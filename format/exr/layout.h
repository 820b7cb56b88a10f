// Headers and chunks of an EXR file, before a pixel is decoded. OpenEXR's C++ reader searches the file for
// the chunks of a broken table, which can take minutes, and accepts a truncated file; its C core (3.1.5)
// drops repeated attributes and sorts channels, so that a wrong value or the pixels of another channel would
// be read (docs/architecture.md).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "format/base/guard.h"
#include "format/base/input_file.h"
#include "format/exr/exr.h"

namespace selvedge {

/// Throws a Failure of no file yet.
[[noreturn]] inline void throw_exr_failure(Code code, std::string place, std::string message) {
  throw Failure{{code, {}, std::move(place), std::move(message)}};
}

/// A chunk, its pixels within its level, and its place in the file.
struct ExrChunk {
  int level = 0;
  int column = 0;  ///< column and row of a tile; 0 and the first pixel row of a scanline chunk
  int row = 0;
  int left = 0;  ///< first pixel
  int top = 0;
  int width = 0;
  int height = 0;
  std::uint32_t packed_bytes = 0;
  std::uint64_t offset = 0;  ///< of the packed pixels in the file, after the chunk's header
};

struct ExrLayout {
  std::vector<ExrPart> parts;
  std::vector<std::vector<ExrChunk>> chunks;  ///< per part, in the order of exr_chunks()
  std::uint64_t headers_end = 0;              ///< of the headers, where the offset tables begin
};

/// Reads headers, offset tables and headers of chunks. Throws a Failure of no file yet, with the codes of
/// ExrReader.
ExrLayout read_exr_layout(const InputFile& source, const ExrLimits& limits);
/// Its first half: the headers.
ExrLayout read_exr_headers(const InputFile& source, const ExrLimits& limits);

/// The beginning of a file of these parts, up to its offset tables. Precondition: exr_with_defaults().
std::string encode_exr_headers(const std::vector<ExrPart>& parts);

/// Sets tiles and levels that a writer may choose: tiles of 32 x 32 or, for larger parts, 64 x 64 pixels.
ExrPart exr_with_defaults(ExrPart part);

/// Indices of the channels in byte order of their names, which is the order in a file.
std::vector<std::size_t> exr_channel_order(const ExrPart& part);

/// Number of chunks of the part. Precondition: its size, tiles and levels are valid.
std::uint64_t exr_chunk_count(const ExrPart& part);

/// All chunks in the order of the part's offset table: by level, then by rows from the top, then from the
/// left. Sizes and offsets in the file are not set.
std::vector<ExrChunk> exr_chunks(const ExrPart& part);

/// Decoded bytes of one pixel of all channels.
std::uint64_t exr_pixel_bytes(const ExrPart& part);

/// "part/member" for messages; either may be empty.
std::string exr_place(const std::string& part, const std::string& member);

/// The place of a chunk in messages: "part/level 0/tile 1,2" or "part/row 16".
std::string exr_place(const ExrPart& part, const ExrChunk& chunk);

}  // namespace selvedge
