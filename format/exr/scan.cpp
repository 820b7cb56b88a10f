#include "format/exr/scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "format/exr/bytes.h"

namespace selvedge {
namespace {

/// Reads the offset table of a part, 8 bytes per chunk, at offset `at`, which is advanced to its end.
Result<std::vector<std::uint64_t>> read_table(const InputFile& source, const ExrPart& part,
                                              const std::string& file, std::uint64_t& at) {
  const std::uint64_t count = exr_chunk_count(part);
  if (count > (source.size() - at) / 8) {
    return fail(Code::file_damaged, file, part.name,
                fmt::format("ends within the offsets of the {} chunks", count));
  }
  std::vector<std::uint8_t> bytes(count * 8);
  if (!source.read(at, bytes)) return fail(Code::file_unreadable, file, part.name, "cannot be read");
  at += bytes.size();
  ExrBytes numbers(bytes);
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
  std::sort(ranges.begin(), ranges.end(), [](const Range& a, const Range& b) { return a.begin < b.begin; });
  return std::adjacent_find(ranges.begin(), ranges.end(),
                            [](const Range& a, const Range& b) { return a.end > b.begin; }) != ranges.end();
}

struct Scanner {
  const InputFile& source;
  const ExrHeader& header;
  const std::string& file;
  const ExrLimits& limits;
  std::uint64_t first;  ///< smallest offset of a chunk

  /// Checks the header of the chunk at this offset, sets the chunk's size and offset in the file, and returns
  /// its bytes.
  Result<Range> locate(int part_index, std::uint64_t offset, ExrChunk& chunk) {
    const ExrPart& part = header.parts[part_index];
    const auto damaged = [&](std::string message) {
      return fail(Code::file_damaged, file, exr_place(part, chunk), std::move(message));
    };
    std::vector<std::int32_t> expected{chunk.y};
    if (part.tiled) expected = {chunk.x, chunk.y, chunk.level, chunk.level};
    if (header.multipart) expected.insert(expected.begin(), part_index);
    const std::uint64_t head_bytes = (expected.size() + 1) * 4;
    if (offset == 0) return damaged("was never written");
    if (offset < first || offset > source.size() || source.size() - offset < head_bytes) {
      return damaged(fmt::format("its offset {} is outside of the chunks", offset));
    }
    std::array<std::uint8_t, 24> bytes{};
    if (!source.read(offset, std::span(bytes).first(head_bytes))) return damaged("cannot be read");
    ExrBytes head(bytes);
    for (const std::int32_t number : expected) {
      if (head.i32() != number) return damaged("another chunk stands at its offset");
    }
    const std::uint64_t packed = head.u32();
    const std::uint64_t pixels = std::uint64_t{1} * chunk.width * chunk.height;
    const std::uint64_t unpacked = pixels * exr_pixel_bytes(part);
    if (packed > source.size() - offset - head_bytes) return damaged("reaches beyond the end of the file");
    // Chunks that a codec does not make smaller are stored uncompressed, so `packed` is at most `unpacked`.
    // For lossy codecs, which are not decoded, sizes are unknown.
    const bool lossy = is_lossy(part.compression);
    if (packed == 0 || (!lossy && packed > unpacked) || (part.compression == "none" && packed != unpacked)) {
      return damaged(fmt::format("has {} packed bytes for {} of pixels", packed, unpacked));
    }
    const std::uint64_t floats = pixels * part.channels.size() * sizeof(float);
    if (!lossy && floats > limits.expansion * packed) {
      return fail(Code::file_too_large, file, part.name,
                  fmt::format("{} bytes of pixels from {} bytes", floats, packed));
    }
    chunk.packed_bytes = static_cast<std::uint32_t>(packed);
    chunk.offset = offset + head_bytes;
    return Range{offset, chunk.offset + packed};
  }
};

}  // namespace

Result<ExrScan> scan_exr(const InputFile& source, const std::string& file, const ExrLimits& limits) {
  auto header = read_exr_header(source, file, limits);
  if (!header) return tl::unexpected(header.error());
  std::vector<std::vector<std::uint64_t>> tables;
  std::uint64_t at = header->end;
  for (const ExrPart& part : header->parts) {
    auto table = read_table(source, part, file, at);
    if (!table) return tl::unexpected(table.error());
    tables.push_back(std::move(*table));
  }
  Scanner scanner{source, *header, file, limits, at};
  ExrScan scan;
  scan.bytes = at;
  std::vector<Range> ranges;
  for (std::size_t p = 0; p < tables.size(); ++p) {
    std::vector<ExrChunk>& chunks = scan.chunks.emplace_back(exr_chunks(header->parts[p]));
    for (std::size_t c = 0; c < chunks.size(); ++c) {
      const auto range = scanner.locate(static_cast<int>(p), tables[p][c], chunks[c]);
      if (!range) return tl::unexpected(range.error());
      ranges.push_back(*range);
      scan.bytes += chunks[c].offset - range->begin;
    }
  }
  if (overlap(ranges)) return fail(Code::file_damaged, file, {}, "chunks share bytes of the file");
  scan.parts = std::move(header->parts);
  return scan;
}

}  // namespace selvedge
