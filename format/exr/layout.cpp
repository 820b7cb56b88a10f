#include "format/exr/layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "format/base/mip.h"
#include "format/exr/bytes.h"

namespace selvedge {
namespace {

/// Width and height of a chunk away from the edges.
V2i chunk_size(const ExrPart& part) {
  if (part.has_mipmaps) return part.tile_size;
  return {part.width, part.is_zipped ? 16 : 1};
}

[[noreturn]] void damaged(std::string place, std::string message) {
  throw_exr_failure(Code::file_damaged, std::move(place), std::move(message));
}

/// Reads the offset table of a part, 8 bytes per chunk, at offset `at`, which is advanced to its end.
std::vector<std::uint64_t> read_table(const InputFile& source, const ExrPart& part, std::uint64_t& at) {
  const std::uint64_t count = exr_chunk_count(part);
  if (count > (source.size() - at) / 8)
    damaged(part.name, fmt::format("ends within the offsets of the {} chunks", count));
  std::vector<std::uint8_t> bytes(count * 8);
  if (!source.read(at, bytes)) throw_exr_failure(Code::file_unreadable, part.name, "cannot be read");
  at += bytes.size();
  ExrByteReader numbers(bytes);
  std::vector<std::uint64_t> table(count);
  for (std::uint64_t& offset : table) offset = numbers.u64();
  return table;
}

/// Bytes [begin, end) of a file.
struct Range {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
};

/// Whether chunks share bytes: a small file could refer to the same pixels a million times.
bool overlap(std::vector<Range>& ranges) {
  std::ranges::sort(ranges, {}, &Range::begin);
  return std::adjacent_find(ranges.begin(), ranges.end(),
                            [](const Range& a, const Range& b) { return a.end > b.begin; }) != ranges.end();
}

/// Checks the header of the chunk at this offset, which is at least `first`; sets the chunk's size and offset
/// in the file, and returns its bytes.
Range locate(const InputFile& source, const ExrPart& part, int part_index, std::uint64_t first,
             std::uint64_t offset, const ExrLimits& limits, ExrChunk& chunk) {
  std::vector<std::int32_t> expected{part_index, chunk.row};
  if (part.has_mipmaps) expected = {part_index, chunk.column, chunk.row, chunk.level, chunk.level};
  const std::uint64_t head_bytes = (expected.size() + 1) * 4;
  if (offset < first || offset > source.size() || source.size() - offset < head_bytes)
    damaged(exr_place(part, chunk), fmt::format("its offset {} is outside of the chunks", offset));
  std::array<std::uint8_t, 24> bytes{};
  if (!source.read(offset, std::span(bytes).first(head_bytes)))
    damaged(exr_place(part, chunk), "cannot be read");
  ExrByteReader head(bytes);
  for (const std::int32_t number : expected)
    if (head.i32() != number) damaged(exr_place(part, chunk), "its offset points to another chunk");
  const std::uint64_t packed = head.u32();
  const std::uint64_t pixels = std::uint64_t{1} * chunk.width * chunk.height;
  const std::uint64_t unpacked = pixels * exr_pixel_bytes(part);
  if (packed > source.size() - offset - head_bytes)
    damaged(exr_place(part, chunk), "reaches beyond the end of the file");
  // Chunks that ZIP does not make smaller are stored uncompressed, so `packed` is at most `unpacked`.
  if (packed == 0 || packed > unpacked || (!part.is_zipped && packed != unpacked))
    damaged(exr_place(part, chunk), fmt::format("has {} packed bytes for {} of pixels", packed, unpacked));
  const std::uint64_t floats = pixels * part.channels.size() * sizeof(float);
  if (floats > limits.floats_per_byte * packed)
    throw_exr_failure(Code::file_too_large, part.name,
                      fmt::format("{} bytes of pixels from {} bytes", floats, packed));
  chunk.packed_bytes = static_cast<std::uint32_t>(packed);
  chunk.offset = offset + head_bytes;
  return {offset, chunk.offset + packed};
}

}  // namespace

ExrPart exr_with_defaults(ExrPart part) {
  part.levels = part.has_mipmaps ? level_count(part.width, part.height) : 1;
  const int side = std::max(part.width, part.height) > 32 ? 64 : 32;
  if (part.tile_size.x == 0) part.tile_size = {side, side};
  return part;
}

std::vector<std::size_t> exr_channel_order(const ExrPart& part) {
  std::vector<std::size_t> order(part.channels.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(
      order, [&](std::size_t a, std::size_t b) { return part.channels[a].name < part.channels[b].name; });
  return order;
}

std::uint64_t exr_chunk_count(const ExrPart& part) {
  const V2i size = chunk_size(part);
  const auto pieces = [](std::uint64_t whole, std::uint64_t piece) { return (whole + piece - 1) / piece; };
  std::uint64_t count = 0;
  for (int level = 0; level < part.levels; ++level)
    count += pieces(level_size(part.width, level), size.x) * pieces(level_size(part.height, level), size.y);
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
        chunks.push_back({level, left / size.x, part.has_mipmaps ? top / size.y : top, left, top,
                          std::min(size.x, width - left), std::min(size.y, height - top)});
      }
    }
  }
  return chunks;
}

std::uint64_t exr_pixel_bytes(const ExrPart& part) {
  std::uint64_t bytes = 0;
  for (const ExrChannel& channel : part.channels) bytes += channel.is_half ? 2 : 4;
  return bytes;
}

std::string exr_place(const std::string& part, const std::string& member) {
  return part.empty() || member.empty() ? part + member : part + "/" + member;
}

std::string exr_place(const ExrPart& part, const ExrChunk& chunk) {
  return exr_place(part.name, part.has_mipmaps
                                  ? fmt::format("level {}/tile {},{}", chunk.level, chunk.column, chunk.row)
                                  : fmt::format("row {}", chunk.row));
}

ExrLayout read_exr_layout(const InputFile& source, const ExrLimits& limits) {
  ExrLayout layout = read_exr_headers(source, limits);
  std::vector<std::vector<std::uint64_t>> tables;
  std::uint64_t at = layout.headers_end;
  for (const ExrPart& part : layout.parts) tables.push_back(read_table(source, part, at));
  std::vector<Range> ranges;
  for (std::size_t p = 0; p < tables.size(); ++p) {
    std::vector<ExrChunk>& chunks = layout.chunks.emplace_back(exr_chunks(layout.parts[p]));
    for (std::size_t c = 0; c < chunks.size(); ++c)
      ranges.push_back(
          locate(source, layout.parts[p], static_cast<int>(p), at, tables[p][c], limits, chunks[c]));
  }
  if (overlap(ranges)) damaged({}, "chunks share bytes of the file");
  return layout;
}

}  // namespace selvedge
