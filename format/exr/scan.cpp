#include "format/exr/scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "format/exr/bytes.h"
#include "format/exr/header.h"

namespace selvedge {
namespace {

/// The tables of all parts follow the headers, 8 bytes per chunk. Gives the first byte after them.
Result<std::uint64_t> read_tables(ExrSource& source, const ExrHeader& header, const std::string& file,
                                  std::vector<std::vector<std::uint64_t>>& tables) {
  std::uint64_t at = header.end;
  for (const ExrPart& part : header.parts) {
    const std::uint64_t count = exr_chunk_count(part);
    if (count > (source.size() - at) / 8) {
      return fail(Code::file_damaged, file, part.name,
                  fmt::format("ends within the offsets of the {} chunks", count));
    }
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(count * 8));
    if (!source.read(at, bytes)) return fail(Code::file_unreadable, file, part.name, "cannot be read");
    ExrBytes numbers(bytes);
    std::vector<std::uint64_t>& table = tables.emplace_back(static_cast<std::size_t>(count));
    for (std::uint64_t& offset : table) offset = numbers.u64();
    at += count * 8;
  }
  return at;
}

/// The bytes of a file from `begin` up to and without `end`.
struct Range {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
};

/// Checks what stands before the packed pixels of each chunk.
class ChunkHeads {
 public:
  /// The first chunk may begin at `first`.
  ChunkHeads(ExrSource& source, const ExrHeader& header, const std::string& file, const ExrLimits& limits,
             std::uint64_t first)
      : source_(source), header_(header), file_(file), limits_(limits), first_(first) {}

  Result<ExrPlacedChunk> check(std::size_t part_index, const ExrChunk& chunk, std::uint64_t offset) {
    const ExrPart& part = header_.parts[part_index];
    const auto damaged = [&](std::string message) {
      const std::string which = part.tiled ? fmt::format("level {}/tile {},{}", chunk.level, chunk.x, chunk.y)
                                           : fmt::format("row {}", chunk.y);
      return fail(Code::file_damaged, file_, exr_place(part.name, which), std::move(message));
    };
    std::array<std::int32_t, 5> expected{};
    std::size_t count = 0;
    if (header_.multipart) expected.at(count++) = static_cast<std::int32_t>(part_index);
    if (part.tiled) expected.at(count++) = chunk.x;
    expected.at(count++) = chunk.y;
    if (part.tiled) {
      expected.at(count++) = chunk.level;
      expected.at(count++) = chunk.level;
    }
    const std::uint64_t head_bytes = (count + 1) * 4;
    if (offset == 0) return damaged("was never written");
    if (offset < first_ || offset > source_.size() || source_.size() - offset < head_bytes) {
      return damaged(fmt::format("its offset {} is outside of the chunks", offset));
    }
    std::array<std::uint8_t, 24> bytes{};
    if (!source_.read(offset, std::span(bytes).first(head_bytes))) {
      return damaged("cannot be read");
    }
    ExrBytes head(bytes);
    for (const std::int32_t number : std::span(expected).first(count)) {
      if (head.i32() != number) return damaged("another chunk stands at its offset");
    }
    const std::uint64_t packed = head.u32();
    const auto pixels = static_cast<std::uint64_t>(chunk.width) * static_cast<std::uint64_t>(chunk.height);
    const std::uint64_t unpacked = pixels * exr_pixel_bytes(part);
    if (packed > source_.size() - offset - head_bytes) return damaged("reaches beyond the end of the file");
    // A codec that makes nothing smaller is left out, so packed is never more. Nothing is known of lossy
    // ones: they are not decoded.
    const bool lossy = is_lossy(part.compression);
    if (packed == 0 || (!lossy && packed > unpacked) || (part.compression == "none" && packed != unpacked)) {
      return damaged(fmt::format("has {} packed bytes for {} of pixels", packed, unpacked));
    }
    const std::uint64_t floats = pixels * part.channels.size() * sizeof(float);
    if (!lossy && floats > limits_.expansion * packed) {
      return fail(Code::file_too_large, file_, part.name,
                  fmt::format("{} bytes of pixels from {} bytes", floats, packed));
    }
    used_.push_back({offset, offset + head_bytes + packed});
    return ExrPlacedChunk{chunk, static_cast<std::uint32_t>(packed), offset + head_bytes};
  }

  /// Whether chunks share bytes: a small file could name the same pixels a million times.
  bool overlap() {
    std::sort(used_.begin(), used_.end(), [](const Range& a, const Range& b) { return a.begin < b.begin; });
    return std::adjacent_find(used_.begin(), used_.end(),
                              [](const Range& a, const Range& b) { return a.end > b.begin; }) != used_.end();
  }

 private:
  ExrSource& source_;
  const ExrHeader& header_;
  const std::string& file_;
  const ExrLimits& limits_;
  std::uint64_t first_;
  std::vector<Range> used_;
};

}  // namespace

Result<ExrScan> scan_exr(ExrSource& source, const std::string& file, const ExrLimits& limits) {
  auto header = read_exr_header(source, file, limits);
  if (!header) return tl::unexpected(header.error());
  std::vector<std::vector<std::uint64_t>> tables;
  const auto first = read_tables(source, *header, file, tables);
  if (!first) return tl::unexpected(first.error());
  ExrScan scan;
  ChunkHeads heads(source, *header, file, limits, *first);
  for (std::size_t p = 0; p < tables.size(); ++p) {
    const std::vector<ExrChunk> chunks = exr_chunks(header->parts[p]);
    std::vector<ExrPlacedChunk>& placed = scan.chunks.emplace_back();
    placed.reserve(chunks.size());
    for (std::size_t c = 0; c < chunks.size(); ++c) {
      const auto chunk = heads.check(p, chunks[c], tables[p][c]);
      if (!chunk) return tl::unexpected(chunk.error());
      placed.push_back(*chunk);
    }
  }
  if (heads.overlap()) return fail(Code::file_damaged, file, {}, "chunks share bytes of the file");
  scan.parts = std::move(header->parts);
  return scan;
}

}  // namespace selvedge
