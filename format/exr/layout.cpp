#include "format/exr/layout.h"

#include <algorithm>

#include "format/base/mip.h"

namespace selvedge {
namespace {

std::uint64_t pieces(int size, int piece) {
  return (static_cast<std::uint64_t>(size) + static_cast<std::uint64_t>(piece) - 1) /
         static_cast<std::uint64_t>(piece);
}

int rows_of(const ExrPart& part) { return exr_compressions[exr_compression_index(part.compression)].rows; }

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
  if (!part.tiled) return pieces(part.height, rows_of(part));
  std::uint64_t count = 0;
  for (int level = 0; level < part.levels; ++level) {
    count += pieces(level_size(part.width, level), part.tile_width) *
             pieces(level_size(part.height, level), part.tile_height);
  }
  return count;
}

std::vector<ExrChunk> exr_chunks(const ExrPart& part) {
  std::vector<ExrChunk> chunks;
  chunks.reserve(exr_chunk_count(part));
  if (!part.tiled) {
    const int rows = rows_of(part);
    for (std::int64_t y = 0; y < part.height; y += rows) {
      const auto first = static_cast<int>(y);
      chunks.push_back({0, 0, first, part.width, std::min(rows, part.height - first)});
    }
    return chunks;
  }
  for (int level = 0; level < part.levels; ++level) {
    const std::int64_t width = level_size(part.width, level);
    const std::int64_t height = level_size(part.height, level);
    for (std::int64_t y = 0; y * part.tile_height < height; ++y) {
      for (std::int64_t x = 0; x * part.tile_width < width; ++x) {
        chunks.push_back(
            {level, static_cast<int>(x), static_cast<int>(y),
             static_cast<int>(std::min<std::int64_t>(part.tile_width, width - x * part.tile_width)),
             static_cast<int>(std::min<std::int64_t>(part.tile_height, height - y * part.tile_height))});
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

std::string exr_place(const std::string& part, const std::string& what) {
  return part.empty() || what.empty() ? part + what : part + "/" + what;
}

}  // namespace selvedge
