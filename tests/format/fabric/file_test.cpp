#include "format/fabric/file.h"

#include <doctest/doctest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "format/check/fabric.h"
#include "format/fabric/header.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"

using namespace selvedge;
using nlohmann::json;
using test::Folder;

namespace {

void check_equal(const Fabric& a, const Fabric& b) {
  CHECK(a.period_mm == b.period_mm);
  CHECK(a.reference_height == b.reference_height);
  CHECK(a.thickness_mm == b.thickness_mm);
  CHECK(a.views == b.views);
  CHECK(a.provenance == b.provenance);
  REQUIRE(a.levels.size() == b.levels.size());
  for (std::size_t k = 0; k < a.levels.size(); ++k) {
    const FabricLevel& x = a.levels[k];
    const FabricLevel& y = b.levels[k];
    CHECK(x.width == y.width);
    CHECK(x.height == y.height);
    for (const LayerKind kind : all_layers) CHECK(x[kind] == y[kind]);
    if (!x.has(LayerKind::products)) continue;
    CHECK(x.pairs == y.pairs);
    CHECK(x.bases->view == y.bases->view);
    CHECK(x.bases->light == y.bases->light);
  }
}

/// The first issue of a header with these members; "" for a good one.
std::string verdict(const json& changes) {
  json text = json::parse(header_to_json(header_without_layers(test::lambert_fabric(2, 2, V3f(0.5F)))));
  text.merge_patch(changes);
  IssueSink sink("a.exr");
  const auto header = header_from_json(text.dump(), {}, sink);
  CHECK(header.has_value() == !sink.has_error());
  return header ? "" : to_line(sink.first_error());
}

double taken(const Yarns& yarns) {
  const Yarns::Grid& grid = yarns.grid();
  return static_cast<double>(std::span(grid.cells).size_bytes() + std::span(grid.blocks).size_bytes() +
                             yarns.geometry().segments.size_bytes());
}

/// Thin yarn to and fro over a hundred repeats: a few nodes, thousands of cells for each.
YarnData far_and_wide(const V2f& period) {
  YarnData data = test::straight(period.x, 0.01F * period.x);
  for (std::size_t i = 0; i < data.nodes.size(); ++i) {
    const float side = i % 2 == 0 ? -50.0F : 50.0F;
    data.nodes[i] = {side * period.x, 0.3F * side * period.y, 1};
  }
  return data;
}

}  // namespace

TEST_CASE("a fabric comes back from its file bit by bit") {
  const Folder folder;
  for (const auto& [width, height, views, lobes] : {std::tuple{32, 32, DirectionGrid{8, 8}, 2},
                                                    {5, 3, DirectionGrid{2, 3}, 1},
                                                    {1, 1, DirectionGrid{1, 1}, 0},
                                                    {7, 1, DirectionGrid{1, 7}, 3},
                                                    {100, 40, DirectionGrid{2, 2}, 1}}) {
    const Fabric fabric = test::random_product_fabric(width, height, views, lobes, 3);
    const std::string path = folder / "a.fabric.exr";
    test::need(write_fabric(path, fabric));
    const auto read = test::need(read_fabric(path));
    check_equal(fabric, read);
  }
}

TEST_CASE("layers and levels that a fabric lacks stay absent") {
  const Folder folder;
  Fabric fabric = test::random_fabric(8, 8, {2, 2}, 1, 5);
  fabric.levels[1].remove_layer(LayerKind::table);
  fabric.levels[2].remove_layer(LayerKind::lobes);
  for (FabricLevel& level : fabric.levels) level.remove_layer(LayerKind::frame);
  fabric.levels.pop_back();
  REQUIRE(write_fabric(folder / "a.exr", fabric));
  const auto read = test::need(read_fabric(folder / "a.exr"));
  check_equal(fabric, read);
}

TEST_CASE("values that half precision cannot hold are refused with their place, and nothing is left") {
  const Folder folder;
  Fabric fabric = test::random_fabric(4, 4, {2, 2}, 1, 4);
  fabric.levels[0].view_table()[5].y = 1e6F;
  const Error error = test::error_of(write_fabric(folder / "a.exr", fabric));
  CHECK(error.code == Code::fabric_not_finite);
  CHECK(error.place == "table/table.0001.green/pixel 1,0");
  CHECK(folder.files() == 0);
  FabricWriteOptions wide{.half_layers = {}};
  CHECK(write_fabric(folder / "a.exr", fabric, wide));
}

TEST_CASE("half precision keeps 11 bits up to 65504, steps of 2^-24 near 0, and refuses more") {
  const std::array<std::array<float, 2>, 9> kept{{{0, 0},
                                                  {0x1p-25F, 0},  // a tie goes to the even one
                                                  {0x1.000002p-25F, 0x1p-24F},
                                                  {0x1.8p-24F, 0x1p-23F},
                                                  {0x1p-14F, 0x1p-14F},
                                                  {1 + 0x1p-11F, 1},
                                                  {1 + 0x1.8p-11F, 1 + 0x1p-10F},
                                                  {65504, 65504},
                                                  {1e-38F, 0}}};
  const Folder folder;
  Fabric fabric = test::lambert_fabric(1, 1, {1, 1, 1});
  fabric.views = {9, 1};
  std::vector<float> table;
  for (const auto& [given, stored] : kept) table.insert(table.end(), 3, given);
  fabric.levels[0].set_layer(LayerKind::table, {27, table});
  FabricWriteOptions options{.half_layers = LayerSet::all()};
  test::need(write_fabric(folder / "a.exr", fabric, options));
  const Fabric read = test::need(read_fabric(folder / "a.exr"));
  for (std::size_t i = 0; i < kept.size(); ++i) CHECK(read.levels[0].view_table()[i].x == kept[i][1]);
  fabric.levels[0].view_table()[4].x = 65504.004F;
  CHECK(test::error_of(write_fabric(folder / "b.exr", fabric, options)).code == Code::fabric_not_finite);
}

TEST_CASE("values that no reader takes are not written") {
  const Folder folder;
  Fabric fabric = test::random_product_fabric(4, 4, {2, 2}, 1, 4);
  SUBCASE("NaN in a lobe") { fabric.levels[1].lobes()[3] = std::nanf(""); }
  SUBCASE("opacity above 1") { fabric.levels[0].opacity()[7] = 1.5F; }
  SUBCASE("NaN in the functions that all texels share") {
    ProductBases bases = *fabric.levels[0].bases;
    bases.view[1] = std::nanf("");
    for (FabricLevel& level : fabric.levels) level.bases = std::make_shared<const ProductBases>(bases);
  }
  CHECK(test::error_of(write_fabric(folder / "a.exr", fabric)).code == Code::fabric_not_finite);
  CHECK(folder.files() == 0);
}

TEST_CASE("in any precision a fabric that is read and written again has the same bytes") {
  const Folder folder;
  const Fabric fabric = test::with_yarn(test::random_product_fabric(13, 8, {3, 2}, 2, 9), 4);
  FabricWriteOptions options;
  for (const LayerSet& half :
       {LayerSet(), half_precision_layers, LayerSet{LayerKind::lobes}, LayerSet::all()}) {
    options.half_layers = half;
    test::need(write_fabric(folder / "a.exr", fabric, options));
    CHECK(test::need(fabric_file_bytes(fabric, options)) == std::filesystem::file_size(folder / "a.exr"));
    auto reader = test::need(FabricReader::open(folder / "a.exr"));
    for (const LayerKind kind : {LayerKind::lobes, LayerKind::table, LayerKind::yarns})
      CHECK(reader.is_half(kind) == half.contains(kind));
    const auto once = test::need(reader.read());
    // 32 bits hold all; 16 bits what random_fabric makes exact in them, and lobes once they are rounded.
    if (!half.contains(LayerKind::lobes)) check_equal(fabric, once);
    REQUIRE(write_fabric(folder / "b.exr", once, options));
    CHECK(test::bytes_of(folder / "a.exr") == test::bytes_of(folder / "b.exr"));
    check_equal(once, *read_fabric(folder / "b.exr"));
  }
}

TEST_CASE("functions of levels that begin after level 0 are stored as they are read") {
  Fabric fabric = test::random_product_fabric(16, 16, {4, 4}, 1, 3);
  // The last level alone has products: one texel, fewer than there are values of functions.
  for (FabricLevel& level : fabric.levels) {
    if (level.texels() == 1) continue;
    level.remove_layer(LayerKind::products);
    level.bases.reset();
  }
  const ProductBases before = *fabric.levels.back().bases;
  const Fabric stored = round_to_stored_precision(fabric, LayerSet::all());
  const ProductBases& after = *stored.levels.back().bases;
  REQUIRE(after.view.size() == before.view.size());
  for (std::size_t i = 0; i < before.view.size(); ++i)
    CHECK(after.view[i] == doctest::Approx(before.view[i]).epsilon(1e-3));
  REQUIRE(after.light.size() == before.light.size());
  for (std::size_t i = 0; i < before.light.size(); ++i)
    CHECK((after.light[i] - before.light[i]).length() < 1e-3F);
  for (std::size_t k = 0; k + 1 < stored.levels.size(); ++k) CHECK_FALSE(stored.levels[k].bases);
}

TEST_CASE("files of 4.x are read; files of 3.x are refused in a line that names make") {
  CHECK(verdict(json::object()).empty());
  CHECK(verdict({{"version", {4, 7}}}).empty());
  CHECK(verdict({{"version", {3, 1}}}) ==
        "a.exr: /version: fabric version 3.1 is no longer read: make the fabric again with 'selvedge make' "
        "[FABRIC_VERSION]");
  CHECK(verdict({{"version", {6, 0}}}).find("[FABRIC_VERSION]") != std::string::npos);
  CHECK(verdict({{"version", "4.0"}}).find("[FABRIC_MEMBER]") != std::string::npos);
}

TEST_CASE("yarn takes no more than is reckoned of its nodes") {
  for (const V2f& period : {V2f(2, 2), V2f(0.01F, 3), V2f(30, 0.5F)}) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      Random random(seed);
      const YarnData data = test::tangle(random, period, 4);
      CHECK(taken(Yarns(data, period)) <= yarn_memory_bytes(data, period));
      const YarnData plies = test::plied(data);
      CHECK(taken(Yarns(plies, period)) <= yarn_memory_bytes(plies, period));
    }
    CHECK(taken(Yarns(far_and_wide(period), period)) <= yarn_memory_bytes(far_and_wide(period), period));
  }
}

TEST_CASE("levels are refused beyond the memory that is allowed, by reader and checker") {
  const Folder folder;
  const std::string path = folder / "a.exr";
  const Fabric fabric = test::random_product_fabric(9, 4, {2, 3}, 2, 8);
  REQUIRE(write_fabric(path, fabric));
  const FabricReader reader = test::need(FabricReader::open(path));
  std::uint64_t floats = 0;
  for (const FabricLevel& level : fabric.levels)
    for (const LayerKind kind : all_layers) floats += level[kind].values.size();
  const std::uint64_t memory = reader.peak_memory_bytes();
  CHECK(memory >= floats * sizeof(float));
  CHECK(memory < 8 * floats * sizeof(float));
  CHECK(read_fabric(path, {.memory = memory}).has_value());
  const Error beyond = test::error_of(read_fabric(path, {.memory = memory - 1}));
  CHECK(beyond.code == Code::file_too_large);
  CHECK(beyond.message.find("--max-memory") != std::string::npos);
  CHECK_FALSE(has_error(check_fabric(path, {.memory = memory}).issues));
  CHECK(to_line(check_fabric(path, {.memory = memory - 1}).issues.at(0)) == to_line(beyond));
}

TEST_CASE("yarn that runs through more cells than there is memory for is refused before they are made") {
  const Folder folder;
  const std::string path = folder / "a.exr";
  Fabric fabric = test::random_fabric(4, 4, {2, 2}, 1, 1);
  const V2f period = fabric.period_mm;
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(far_and_wide(period), period));
  REQUIRE(write_fabric(path, fabric));
  CHECK(read_fabric(path).has_value());
  const FabricLimits limits{.memory = 16U << 20U};
  const Error beyond = test::error_of(read_fabric(path, limits));
  CHECK(beyond.code == Code::file_too_large);
  CHECK(beyond.place == "yarns");
  const Issues found = check_fabric(path, limits).issues;
  REQUIRE(found.size() == 1);
  CHECK(found.front().code == Code::file_too_large);
}
