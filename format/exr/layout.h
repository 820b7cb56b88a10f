// Chunks and compressions of an EXR part, as its header defines them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "format/exr/exr.h"

namespace selvedge {

struct ExrCompression {
  std::string_view name;
  int rows;  ///< of a chunk of a scanline part
  bool lossy;
};

/// Indexed by the number of the compression in the file.
inline constexpr std::array exr_compressions{
    ExrCompression{"none", 1, false},  ExrCompression{"rle", 1, false},  ExrCompression{"zips", 1, false},
    ExrCompression{"zip", 16, false},  ExrCompression{"piz", 32, false}, ExrCompression{"pxr24", 16, true},
    ExrCompression{"b44", 32, true},   ExrCompression{"b44a", 32, true}, ExrCompression{"dwaa", 32, true},
    ExrCompression{"dwab", 256, true},
};

/// Index into exr_compressions, or -1.
int exr_compression_index(std::string_view name);

/// A chunk, its pixels within its level, and where they lie in the file.
struct ExrChunk {
  int level = 0;
  int x = 0;  ///< column and row of a tile; 0 and the first pixel row of a scanline chunk
  int y = 0;
  int left = 0;  ///< first pixel
  int top = 0;
  int width = 0;
  int height = 0;
  std::uint32_t packed_bytes = 0;
  std::uint64_t offset = 0;  ///< of the packed pixels in the file, after the chunk's header
  bool is_read = false;      ///< the reader has read its pixels before
};

/// Number of chunks of the part. Precondition: its size, tiles, levels and compression are valid.
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
