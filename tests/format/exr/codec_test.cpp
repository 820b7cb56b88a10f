// Chunks and codecs: what OpenEXR packs, the reader unpacks; what is packed wrongly it refuses.
#include <doctest/doctest.h>

#include <cmath>

#include "format/base/random.h"
#include "format/exr/exr.h"
#include "format/exr/scan.h"
#include "format/exr/unpack.h"
#include "tests/format/damage.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

ExrPart mixed_part(int width, int height) {
  ExrPart part;
  part.name = "mixed";
  part.width = width;
  part.height = height;
  part.channels = {{"a.half", true}, {"b.float", false}, {"c.half", true}};
  return part;
}

int level_side(int side, int level) { return std::max(1, side >> level); }

/// Values exact in half; long runs in one channel, noise in the others.
ExrPixels pixels_of(const ExrPart& part, int level, std::uint64_t seed) {
  ExrPixels pixels{level_side(part.width, level), level_side(part.height, level), {}};
  Random random(seed + static_cast<std::uint64_t>(level));
  for (std::size_t c = 0; c < part.channels.size(); ++c) {
    std::vector<float> plane;
    for (int i = 0; i < pixels.width * pixels.height; ++i) {
      const auto noise = static_cast<float>(static_cast<int>(random.uniform() * 4096) - 2048);
      plane.push_back(c == 2 ? static_cast<float>(i / 50) : noise / 16);
    }
    pixels.planes.push_back(std::move(plane));
  }
  return pixels;
}

void write_all(const std::string& path, const ExrPart& part, int levels) {
  auto writer = test::need(ExrWriter::create(path, {part}));
  for (int k = 0; k < levels; ++k) REQUIRE(writer.write_level(0, k, pixels_of(part, k, 1)));
  REQUIRE(writer.commit());
}

std::string message_of(const Result<ExrPixels>& pixels) {
  return pixels ? std::string() : to_line(pixels.error());
}

}  // namespace

TEST_CASE("what OpenEXR writes in a lossless compression comes back bit by bit") {
  const Folder folder;
  for (const char* compression : {"none", "rle", "zips", "zip", "piz"}) {
    for (const auto& [width, height] : {std::pair{1, 1}, {37, 70}, {64, 3}, {3, 100}}) {
      for (const int layout : {0, 1, 2}) {
        ExrPart part = mixed_part(width, height);
        part.compression = compression;
        part.tiled = layout == 1;
        part.mipmapped = layout == 2;
        part.tile_width = 16;
        part.tile_height = 24;
        part.increasing_y = layout != 1;
        const int levels = layout == 2 ? 1 + static_cast<int>(std::log2(std::max(width, height))) : 1;
        write_all(folder / "a.exr", part, levels);
        auto reader = test::need(ExrReader::open(folder / "a.exr"));
        const ExrPart& read = reader.parts()[0];
        CHECK(read.compression == compression);
        CHECK(read.tiled == (layout != 0));
        CHECK(read.mipmapped == (layout == 2));
        CHECK(read.levels == levels);
        CHECK(read.increasing_y == (layout != 1));
        CHECK(read.tile_width == (layout == 0 ? 0 : 16));
        CHECK(read.tile_height == (layout == 0 ? 0 : 24));
        for (int k = 0; k < levels; ++k) {
          const auto pixels = reader.read_level(0, k);
          REQUIRE_MESSAGE(pixels, compression << ": " << message_of(pixels));
          CHECK(pixels->planes == pixels_of(part, k, 1).planes);
        }
        CHECK_FALSE(reader.read_level(0, levels));
        CHECK_FALSE(reader.read_level(0, -1));
        CHECK_FALSE(reader.read_rows(0, height - 1, 2));
      }
    }
  }
}

TEST_CASE("a lossy or unknown compression is not written") {
  const Folder folder;
  for (const char* compression : {"pxr24", "b44", "b44a", "dwaa", "dwab", "zap", ""}) {
    ExrPart part = mixed_part(4, 4);
    part.compression = compression;
    CHECK(test::error_of(ExrWriter::create(folder / "a.exr", {part})).code == Code::option_out_of_range);
    CHECK(is_lossy(compression) == (std::string(compression) != "zap" && compression[0] != '\0'));
  }
  for (const char* compression : {"none", "rle", "zips", "zip", "piz"}) CHECK_FALSE(is_lossy(compression));
  CHECK(folder.files() == 0);
}

TEST_CASE("a part in a lossy compression is described, but its pixels are not read") {
  const Folder folder;
  ExrPart part = mixed_part(8, 8);
  part.tiled = true;
  write_all(folder / "a.exr", part, 1);
  std::string bytes = test::bytes_of(folder / "a.exr");
  bytes[test::exr_value_at(bytes, "compression", "compression")] = 9;
  auto reader = test::need(ExrReader::open(test::as_bytes(bytes), "dwab"));
  CHECK(reader.parts()[0].compression == "dwab");
  CHECK(test::error_of(reader.read_level(0)).code == Code::exr_unsupported);
}

TEST_CASE("a chunk that decodes to too few or too many bytes is refused, not filled up") {
  const Folder folder;
  ExrPart large = mixed_part(16, 16);
  large.tiled = true;
  ExrPart small = mixed_part(16, 15);
  small.tiled = true;
  for (const char* compression : {"rle", "zip"}) {
    large.compression = compression;
    small.compression = compression;
    const auto unpacked_size = [](const ExrPart& part) {
      return static_cast<std::size_t>(part.width) * static_cast<std::size_t>(part.height) * 8;
    };
    for (const auto& [packed_as, read_as] : {std::pair{small, large}, {large, small}}) {
      write_all(folder / "a.exr", packed_as, 1);
      const std::string bytes = test::bytes_of(folder / "a.exr");
      const InputFile source(test::as_bytes(bytes));
      const auto scan = test::need(scan_exr(source, "a", {}));
      const ExrChunk& chunk = scan.chunks[0][0];
      const auto packed = test::as_bytes(bytes).subspan(chunk.offset, chunk.packed_bytes);
      std::vector<std::uint8_t> good(unpacked_size(packed_as));
      CHECK(exr_unpack(packed_as, chunk, packed, good));
      std::vector<std::uint8_t> bad(unpacked_size(read_as));
      CHECK_FALSE(exr_unpack(read_as, {.width = read_as.width, .height = read_as.height}, packed, bad));
    }
  }
}

TEST_CASE("packed bytes of any kind are decoded or refused") {
  // A short run of what the fuzzers do for hours.
  ExrPart part = mixed_part(20, 14);
  const std::size_t size = 20 * 14 * 8;
  Random random(3);
  const auto byte = [&] { return static_cast<std::uint8_t>(random.uniform() * 256); };
  const Folder folder;
  for (const char* compression : {"rle", "zip", "piz"}) {
    part.compression = compression;
    part.tiled = true;
    auto writer = test::need(ExrWriter::create(folder / "a.exr", {part}));
    ExrPixels smooth = pixels_of(part, 0, 1);
    smooth.planes[0] = smooth.planes[1] = smooth.planes[2];
    REQUIRE(writer.write_level(0, 0, smooth));
    REQUIRE(writer.commit());
    const std::string bytes = test::bytes_of(folder / "a.exr");
    const InputFile source(test::as_bytes(bytes));
    const auto scan = test::need(scan_exr(source, "a", {}));
    const ExrChunk& chunk = scan.chunks[0][0];
    const auto whole = test::as_bytes(bytes).subspan(chunk.offset, chunk.packed_bytes);
    REQUIRE(whole.size() < size);
    std::vector<std::uint8_t> pixels(size);
    int decoded = 0;
    for (int i = 0; i < 2000; ++i) {
      std::vector<std::uint8_t> packed(whole.begin(), whole.end());
      if (i % 2 == 0) packed.resize(1 + static_cast<std::size_t>(random.uniform() * double(whole.size())));
      for (int k = 0; k < 1 + i % 3; ++k) {
        packed[static_cast<std::size_t>(random.uniform() * double(packed.size()))] = byte();
      }
      decoded += exr_unpack(part, chunk, packed, pixels) ? 1 : 0;
    }
    CHECK(decoded < 2000);
    CHECK(exr_unpack(part, chunk, whole, pixels));
  }
}
