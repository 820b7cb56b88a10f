#include "format/exr/layout.h"

#include <fmt/format.h>

#include <algorithm>

#include "format/base/mip.h"

namespace selvedge {
namespace {

/// Width and height of a chunk away from the edges.
V2i chunk_size(const ExrPart& part) {
  if (part.tiled) return {part.tile_width, part.tile_height};
  return {part.width, exr_compressions[exr_compression_index(part.compression)].rows};
}

}  // namespace

int exr_compression_index(std::string_view name) {
  const auto found = std::find_if(exr_compressions.begin(), exr_compressions.end(),
                                  [&](const ExrCompression& row) { return row.name == name; });
  return found == exr_compressions.end() ? -1 : static_cast<int>(found - exr_compressions.begin());
}

bool is_lossy(std::string_view compression) {
  const int index = exr_compression_index(compression);
  return index >= 0 && exr_compressions[index].lossy;
}

std::uint64_t exr_chunk_count(const ExrPart& part) {
  const V2i size = chunk_size(part);
  const auto pieces = [](std::uint64_t whole, std::uint64_t piece) { return (whole + piece - 1) / piece; };
  std::uint64_t count = 0;
  for (int level = 0; level < part.levels; ++level) {
    count += pieces(level_size(part.width, level), size.x) * pieces(level_size(part.height, level), size.y);
  }
  return count;
}

std::vector<ExrChunk> exr_chunks(const ExrPart& part) {
  const V2i size = chunk_size(part);
  std::vector<ExrChunk> chunks;
  chunks.reserve(exr_chunk_count(part));
  for (int level = 0; level < part.levels; ++level) {
    const int width = level_size(part.width, level);
    const int height = level_size(part.height, level);
    for (std::int64_t y = 0; y < height; y += size.y) {
      for (std::int64_t x = 0; x < width; x += size.x) {
        const auto left = static_cast<int>(x);
        const auto top = static_cast<int>(y);
        chunks.push_back({level, left / size.x, part.tiled ? top / size.y : top, left, top,
                          std::min(size.x, width - left), std::min(size.y, height - top)});
      }
    }
  }
  return chunks;
}

std::uint64_t exr_pixel_bytes(const ExrPart& part) {
  std::uint64_t bytes = 0;
  for (const ExrChannel& channel : part.channels) bytes += channel.half ? 2 : 4;
  return bytes;
}

std::string exr_place(const std::string& part, const std::string& member) {
  return part.empty() || member.empty() ? part + member : part + "/" + member;
}

std::string exr_place(const ExrPart& part, const ExrChunk& chunk) {
  return exr_place(part.name, part.tiled ? fmt::format("level {}/tile {},{}", chunk.level, chunk.x, chunk.y)
                                         : fmt::format("row {}", chunk.y));
}

}  // namespace selvedge
