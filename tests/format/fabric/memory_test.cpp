// Memory of the levels and the yarn of a fabric is known before they are there.
#include <doctest/doctest.h>

#include "format/check/fabric.h"
#include "format/fabric/file.h"
#include "tests/format/fabrics.h"
#include "tests/format/files.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"

using namespace selvedge;
using test::Folder;

namespace {

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
