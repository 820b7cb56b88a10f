#include <doctest/doctest.h>

#include <functional>

#include "format/fabric/file.h"
#include "tests/format/fabric_files.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

FabricReader open_reader(const std::string& path) { return test::need(FabricReader::open(path)); }

/// Bytes beside those of opening that a read takes.
std::uint64_t cost(const std::string& path, const std::function<void(FabricReader&)>& read) {
  FabricReader reader = open_reader(path);
  const std::uint64_t opened = reader.bytes_read();
  read(reader);
  return reader.bytes_read() - opened;
}

}  // namespace

TEST_CASE("a level read by itself is that of the whole") {
  const Folder folder;
  const Fabric fabric = test::with_yarn(test::random_product_fabric(9, 4, {2, 3}, 2, 8), 3);
  REQUIRE(write_fabric(folder / "a.exr", fabric));
  FabricReader reader = open_reader(folder / "a.exr");
  CHECK(reader.header().levels == 4);
  CHECK(reader.header().views == fabric.views);
  CHECK(reader.half() == table_layers);
  for (int k = 3; k >= 0; --k) {
    const auto level = test::need(reader.read_level(k));
    const FabricLevel& expected = fabric.levels[k];
    CHECK(level.width == expected.width);
    CHECK(level.height == expected.height);
    for (const LayerKind kind : all_layers) CHECK(level[kind] == expected[kind]);
    CHECK(level.pairs == expected.pairs);
    CHECK(level.bases->light == expected.bases->light);
  }
}

TEST_CASE("layers that were not asked for are not there") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "a.exr", test::random_fabric(4, 4, {2, 2}, 1, 8)));
  FabricReader reader = open_reader(folder / "a.exr");
  const auto level = test::need(reader.read_level(1, {LayerKind::lobes, LayerKind::opacity}));
  CHECK(level.has(LayerKind::lobes));
  CHECK(level.has(LayerKind::opacity));
  CHECK_FALSE(level.has(LayerKind::frame));
  CHECK_FALSE(level.has(LayerKind::table));
}

TEST_CASE("a range of levels is a fabric whose level 0 is its first") {
  const Folder folder;
  const Fabric fabric = test::random_fabric(11, 5, {2, 2}, 1, 8);
  REQUIRE(write_fabric(folder / "a.exr", fabric));
  const auto upper = test::need(open_reader(folder / "a.exr").read_levels(1, 2));
  REQUIRE(upper.levels.size() == 2);
  CHECK(upper.levels[0].width == 5);
  CHECK(upper.levels[1].height == 1);
  CHECK(upper.period_mm == fabric.period_mm);
  CHECK(upper.levels[1][LayerKind::lobes] == fabric.levels[2][LayerKind::lobes]);
  CHECK(validate(upper));
  CHECK(upper.whole == WholeFabric{V2i(11, 5), 1, 4});
  CHECK(open_reader(folder / "a.exr").read_levels(0, 1)->whole == WholeFabric{V2i(11, 5), 0, 4});
  CHECK_FALSE(open_reader(folder / "a.exr").read_levels(0, 3)->whole.has_value());
}

TEST_CASE("a part of a fabric says in its file what it is a part of, and parts of it count on") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "a.exr", test::random_fabric(44, 21, {2, 2}, 1, 8)));
  const auto part = test::need(open_reader(folder / "a.exr").read_levels(2, 5));
  REQUIRE(write_fabric(folder / "b.exr", part));
  FabricReader reader = open_reader(folder / "b.exr");
  CHECK(reader.header().whole == WholeFabric{V2i(44, 21), 2, 6});
  CHECK(reader.read()->whole == reader.header().whole);
  CHECK(whole_texels(reader.header()) == V2i(44, 21));
  CHECK(reader.header().first_level() == 2);
  const auto again = test::need(reader.read_levels(1, 2));
  CHECK(again.whole == WholeFabric{V2i(44, 21), 3, 6});
  CHECK(again.first_level() == 3);
  CHECK(V2i(again.levels[0].width, again.levels[0].height) == V2i(5, 2));
  Fabric wrong = part;
  for (const WholeFabric& whole : {WholeFabric{V2i(44, 21), 3}, WholeFabric{V2i(44, 21), 0},
                                   WholeFabric{V2i(44, 20), 2}, WholeFabric{V2i(45, 21), 2}}) {
    wrong.whole = whole;
    // 45 / 4 and 44 / 4 are both 11, as 20 / 4 and 21 / 4 are 5.
    CHECK(validate(wrong).has_value() == (whole.level == 2));
  }
}

TEST_CASE("a fabric says which levels of the whole it lacks, at either end") {
  FabricHeader header;
  header.width = 16;
  header.height = 8;
  header.levels = 5;
  CHECK(missing_levels(header).empty());
  CHECK(whole_levels(header) == 5);
  header.levels = 2;  // a whole that stops
  CHECK(missing_levels(header).empty());
  header.whole = WholeFabric{V2i(64, 32), 2, 7};
  CHECK(missing_levels(header) ==
        "has levels 2-3 of a whole of 64x32 texels; levels 0-1 and 4-6 of 7 are missing");
  CHECK(whole_levels(header) == 7);
  header.whole->levels = 0;
  CHECK(missing_levels(header) == "has levels 2-3 of a whole of 64x32 texels; levels 0-1 of 4 are missing");
  CHECK(whole_levels(header) == 4);
  header.levels = 1;
  header.whole = WholeFabric{V2i(16, 8), 0, 2};
  CHECK(missing_levels(header) == "has level 0 of a whole of 16x8 texels; level 1 of 2 is missing");
}

TEST_CASE("levels of a whole survive reading and writing, and so does that nothing is known of them") {
  const Folder folder;
  Fabric part = test::random_fabric(44, 21, {2, 2}, 1, 8);
  REQUIRE(part.levels.size() == 6);
  part.levels.resize(3);
  for (const std::optional<WholeFabric>& whole :
       {std::optional<WholeFabric>(), std::optional(WholeFabric{V2i(44, 21), 0, 6}),
        std::optional(WholeFabric{V2i(44, 21), 0, 4}), std::optional(WholeFabric{V2i(89, 42), 1, 4}),
        std::optional(WholeFabric{V2i(89, 42), 1, 7}), std::optional(WholeFabric{V2i(89, 42), 1, 0})}) {
    part.whole = whole;
    REQUIRE(write_fabric(folder / "a.exr", part));
    const auto read = test::need(read_fabric(folder / "a.exr"));
    CHECK(read.whole == whole);
    REQUIRE(write_fabric(folder / "b.exr", read));
    CHECK(test::bytes_of(folder / "a.exr") == test::bytes_of(folder / "b.exr"));
    // Without the last, which there is.
    const auto cut = test::need(open_reader(folder / "b.exr").read_levels(0, 1));
    REQUIRE(cut.whole);
    CHECK(cut.whole->levels == std::max(whole ? whole->levels : 0, part.first_level() + 3));
  }
  for (const WholeFabric& whole :
       {WholeFabric{V2i(44, 21), 0, 0}, WholeFabric{V2i(44, 21), 0, 3}, WholeFabric{V2i(44, 21), 0, 7},
        WholeFabric{V2i(89, 42), 1, 3}, WholeFabric{V2i(89, 42), 1, 8}, WholeFabric{V2i(44, 21), -1, 6}}) {
    part.whole = whole;
    CHECK_FALSE(validate(part));
  }
}

TEST_CASE("level 3 of a large fabric costs a fiftieth of its bytes, its lobes less") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "a.exr", test::random_fabric(128, 128, {4, 4}, 2, 8)));
  const std::string path = folder / "a.exr";
  const auto whole = static_cast<double>(std::filesystem::file_size(path));
  const auto all = cost(path, [](FabricReader& reader) { REQUIRE(reader.read()); });
  const auto level = cost(path, [](FabricReader& reader) { REQUIRE(reader.read_level(3)); });
  const auto lobes =
      cost(path, [](FabricReader& reader) { REQUIRE(reader.read_level(3, {LayerKind::lobes})); });
  CHECK(static_cast<double>(all) > 0.9 * whole);  // all but the preview
  // Level 3 has a 64th of the texels of level 0.
  CHECK(static_cast<double>(level) < 0.02 * whole);
  CHECK(static_cast<double>(lobes) < 0.7 * static_cast<double>(level));
  // And the headers are no great part of the whole.
  CHECK(static_cast<double>(open_reader(path).bytes_read()) < 0.05 * whole);
}

TEST_CASE("damage to one level is an error of that level and of no other") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "good.exr", test::random_fabric(4, 4, {2, 2}, 1, 8)));
  test::OpenedFabric file = test::open_fabric(folder / "good.exr");
  file.plane("table", 1, "table.0002.blue")[3] += 1;
  test::save_fabric(folder / "bad.exr", file);
  FabricReader reader = open_reader(folder / "bad.exr");
  CHECK(reader.read_level(0));
  CHECK(reader.read_level(2));
  CHECK(reader.read_level(1, {LayerKind::lobes, LayerKind::frame, LayerKind::opacity}));
  const Error error = test::error_of(reader.read_level(1));
  CHECK(error.code == Code::fabric_digest);
  CHECK(error.place == "table/level 1");
  CHECK(error.file == folder / "bad.exr");
  CHECK_FALSE(reader.read());
}

TEST_CASE("a bad header is found on opening, before any level is read") {
  const Folder folder;
  REQUIRE(write_fabric(folder / "good.exr", test::random_fabric(4, 4, {2, 2}, 1, 8)));
  test::OpenedFabric file = test::open_fabric(folder / "good.exr");
  file.drop("frame");
  test::save_fabric(folder / "bad.exr", file);
  CHECK(test::error_of(FabricReader::open(folder / "bad.exr")).code == Code::fabric_part);
}
