#include "format/exr/exr.h"

#include <doctest/doctest.h>
#include <sys/stat.h>

#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

ExrPart part_of(const char* name, int width, int height, bool half) {
  ExrPart part;
  part.name = name;
  part.width = width;
  part.height = height;
  part.channels = {{"b", half}, {"a", half}};
  return part;
}

/// Both planes count their pixels, the second one backwards.
ExrPixels ramp(int width, int height, int from = 0) {
  ExrPixels pixels{width, height, std::vector<std::vector<float>>(2)};
  for (int i = 0; i < width * height; ++i) {
    pixels.planes[0].push_back(static_cast<float>(from + i));
    pixels.planes[1].push_back(static_cast<float>(-from - i));
  }
  return pixels;
}

}  // namespace

TEST_CASE("rows written in pieces are read in any range") {
  const Folder folder;
  auto writer = test::need(ExrWriter::create(folder / "a.exr", {part_of("rows", 3, 10, true)}));
  REQUIRE(writer.write_rows(0, ramp(3, 4)));
  REQUIRE(writer.write_rows(0, ramp(3, 6, 12)));
  REQUIRE(writer.commit());
  auto reader = test::need(ExrReader::open(folder / "a.exr"));
  CHECK(reader.find_part("rows") == 0);
  CHECK(reader.find_part("columns") == -1);
  const auto rows = test::need(reader.read_rows(0, 3, 2));
  // The file orders channels by name: "a" comes first.
  CHECK(reader.parts()[0].channels[0].name == "a");
  CHECK(rows.planes[1] == std::vector<float>{9, 10, 11, 12, 13, 14});
  CHECK(rows.planes[0][0] == -9);
}

TEST_CASE("attributes of every kind come back") {
  const Folder folder;
  ExrPart part = part_of("attributes", 1, 1, false);
  part.attributes = {
      {"text", std::string("t")}, {"whole", 7}, {"real", 0.1F}, {"v2", V2f(1, 2)}, {"v3", V3f(3, 4, 5)}};
  auto writer = test::need(ExrWriter::create(folder / "a.exr", {part}));
  REQUIRE(writer.write_rows(0, ramp(1, 1)));
  REQUIRE(writer.commit());
  const auto reader = test::need(ExrReader::open(folder / "a.exr"));
  for (const auto& [name, value] : part.attributes) CHECK(reader.parts()[0].attributes.at(name) == value);
}

TEST_CASE("black compresses as far as ZIP goes and is read all the same") {
  const Folder folder;
  ExrPart part = part_of("black", 1024, 1024, true);
  part.mipmapped = true;
  auto writer = test::need(ExrWriter::create(folder / "a.exr", {part}));
  for (int level = 0, size = 1024; size >= 1; ++level, size /= 2) {
    const auto count = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
    REQUIRE(
        writer.write_level(0, level, {size, size, {std::vector<float>(count), std::vector<float>(count)}}));
  }
  REQUIRE(writer.commit());
  auto reader = test::need(ExrReader::open(folder / "a.exr"));
  CHECK(reader.read_level(0, 0));
}

TEST_CASE("more than the limit is refused before anything is allocated") {
  const Folder folder;
  auto writer = test::need(ExrWriter::create(folder / "a.exr", {part_of("rows", 8, 8, false)}));
  REQUIRE(writer.write_rows(0, ramp(8, 8)));
  REQUIRE(writer.commit());
  const auto refused = [&](const ExrLimits& limits) {
    auto reader = ExrReader::open(folder / "a.exr", limits);
    if (!reader) return reader.error().code == Code::file_too_large;
    const auto pixels = reader->read_level(0);
    return !pixels && pixels.error().code == Code::file_too_large;
  };
  CHECK_FALSE(refused({}));
  CHECK(refused({.pixels_per_part = 63}));
  CHECK(refused({.bytes_per_read = 511}));
  CHECK(refused({.expansion = 0}));
  CHECK(refused({.channels = 1}));
}

TEST_CASE("what has no places to read at is refused and not waited for") {
  const Folder folder;
  REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
  CHECK(ExrReader::open(folder / "pipe").error().code == Code::file_unreadable);
  CHECK(ExrReader::open("/dev/null").error().code == Code::file_unreadable);
  CHECK(ExrReader::open(folder / "pipe/a.exr").error().code == Code::file_missing);
  CHECK(ExrReader::open(folder / "").error().code == Code::file_unreadable);
}
