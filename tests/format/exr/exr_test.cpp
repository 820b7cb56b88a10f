#include "format/exr/exr.h"

#include <doctest/doctest.h>

#include <limits>

#include "format/base/mip.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

ExrPart part_of(const char* name, int width, int height, bool half, bool mipmapped = false) {
  return {.name = name,
          .width = width,
          .height = height,
          .has_mipmaps = mipmapped,
          .channels = {{"b", half}, {"a", half}}};
}

/// Both planes count their pixels, the second one backwards.
ExrPixels ramp(int width, int height) {
  ExrPixels pixels{width, height, std::vector<std::vector<float>>(2)};
  for (int i = 0; i < width * height; ++i) {
    pixels.planes[0].push_back(static_cast<float>(i % 1000));
    pixels.planes[1].push_back(static_cast<float>(-(i % 1000)));
  }
  return pixels;
}

/// Writes ramps of all levels.
void write(const std::string& path, const std::vector<ExrPart>& parts) {
  REQUIRE(write_exr_file(path, parts, [&](int part, int level) {
    return ramp(level_size(parts[part].width, level), level_size(parts[part].height, level));
  }));
}

}  // namespace

TEST_CASE("every level of every part is read as it was written, with ZIP and without") {
  const Folder folder;
  for (const bool zip : {true, false}) {
    for (const bool half : {true, false}) {
      std::vector<ExrPart> parts{part_of("rows", 40, 37, half), part_of("tiles", 70, 33, half, true)};
      for (ExrPart& part : parts) part.is_zipped = zip;
      parts[0].attributes["text"] = "t";
      parts[1].tile_size = {32, 16};
      write(folder / "a.exr", parts);
      auto reader = test::need(ExrReader::open(folder / "a.exr"));
      CHECK(reader.find_part("tiles") == 1);
      CHECK(reader.find_part("columns") == -1);
      CHECK(reader.parts()[0].attributes.at("text") == "t");
      CHECK(reader.parts()[1].is_zipped == zip);
      CHECK(reader.parts()[1].tile_size == V2i(32, 16));
      CHECK(reader.parts()[1].levels == 7);
      // The file orders channels by name: "a" comes first.
      CHECK(reader.parts()[0].channels[0].name == "a");
      CHECK(reader.parts()[0].channels[0].is_half == half);
      for (int p = 0; p < 2; ++p) {
        for (int k = 0; k < reader.parts()[p].levels; ++k) {
          const ExrPixels read = test::need(reader.read_level(p, k));
          const ExrPixels written = ramp(level_size(parts[p].width, k), level_size(parts[p].height, k));
          CHECK(read.planes[1] == written.planes[0]);
          CHECK(read.planes[0] == written.planes[1]);
        }
      }
      CHECK_FALSE(reader.read_level(0, 1));
    }
  }
}

TEST_CASE("values beyond half precision are not written") {
  const Folder folder;
  const ExrPart part = part_of("rows", 2, 1, true);
  for (const float wrong : {65536.0F, std::numeric_limits<float>::quiet_NaN()}) {
    const auto written = write_exr_file(folder / "a.exr", {part, part_of("more", 2, 1, true)}, [&](int, int) {
      return ExrPixels{2, 1, {{0, wrong}, {0, 0}}};
    });
    CHECK(test::error_of(written).place == "rows/b/pixel 1,0");
  }
  CHECK(folder.files() == 0);
}

TEST_CASE("black compresses as far as ZIP goes and is read all the same") {
  const Folder folder;
  const std::vector<ExrPart> parts{part_of("black", 1024, 1024, true, true), part_of("rows", 1, 1, true)};
  REQUIRE(write_exr_file(folder / "a.exr", parts, [&](int part, int level) {
    const int size = level_size(parts[part].width, level);
    const auto count = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
    return ExrPixels{size, size, {std::vector<float>(count), std::vector<float>(count)}};
  }));
  auto reader = test::need(ExrReader::open(folder / "a.exr"));
  CHECK(reader.read_level(0, 0));
}

TEST_CASE("more than the limit is refused before anything is allocated") {
  const Folder folder;
  write(folder / "a.exr", {part_of("rows", 8, 8, false), part_of("more", 8, 8, false)});
  const auto refused = [&](const ExrLimits& limits) {
    auto reader = ExrReader::open(folder / "a.exr", limits);
    if (!reader) return reader.error().code == Code::file_too_large;
    const auto pixels = reader->read_level(0);
    return !pixels && pixels.error().code == Code::file_too_large;
  };
  CHECK_FALSE(refused({}));
  CHECK(refused({.header_bytes = 100}));
  CHECK(refused({.pixels_per_part = 63}));
  CHECK(refused({.bytes_per_read = 511}));
  CHECK(refused({.floats_per_byte = 0}));
  CHECK(refused({.parts = 1}));
  CHECK(refused({.channels = 1}));
  CHECK(refused({.attributes = 5}));
}
