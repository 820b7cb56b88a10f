#include "converter/dress/uv_overlap.h"

#include <doctest/doctest.h>

#include <functional>

#include "format/gltf/read_scene.h"
#include "tests/converter/workshop.h"

using namespace selvedge;
using test::Workshop;

namespace {

/// The overlap of two square metres, the second of which has its texture coordinates changed.
double overlap_with(const std::function<V2f(const V2f&)>& change) {
  Garment garment = test::square(2);
  for (V2f& uv : garment.primitives[1].tex_coords) uv = change(uv);
  garment.primitives[1].material = 0;
  const Workshop workshop(garment);
  const Scene scene = test::need(read_scene(workshop.garment));
  OverlapBudget budget;
  return test::need(overlap_of(scene, {0, 1}, 0, budget));
}

}  // namespace

TEST_CASE("uv overlap: charts beside each other share nothing, and equal or mirrored ones all") {
  CHECK(overlap_with([](const V2f& uv) { return uv + V2f(1, 0); }) == 0);
  CHECK(overlap_with([](const V2f& uv) { return uv - V2f(0, 1); }) == 0);
  CHECK(overlap_with([](const V2f& uv) { return uv + V2f(7, 0); }) == 0);  // another tile is another place
  CHECK(overlap_with([](const V2f& uv) { return uv; }) == doctest::Approx(1));
  CHECK(overlap_with([](const V2f& uv) { return V2f(1 - uv.x, uv.y); }) == doctest::Approx(1));
}

TEST_CASE("uv overlap: of squares that are moved by a part of their side, that part is free") {
  for (const float moved : {0.25F, 0.5F, 0.8F}) {
    CAPTURE(moved);
    CHECK(overlap_with([&](const V2f& uv) { return uv + V2f(moved, 0); }) ==
          doctest::Approx(1 - moved).epsilon(0.01));
    CHECK(overlap_with([&](const V2f& uv) { return uv + V2f(moved, moved); }) ==
          doctest::Approx((1 - moved) * (1 - moved)).epsilon(0.01));
  }
  // Half the size, within the other: all of it, and a quarter of the other. It has half of the area.
  CHECK(overlap_with([](const V2f& uv) { return uv * 0.5F; }) ==
        doctest::Approx(0.5 + 0.5 / 4).epsilon(0.01));
}

TEST_CASE("uv overlap: without texture coordinates, or with all in a point, nothing is shared") {
  CHECK(overlap_with([](const V2f&) { return V2f(0.5F, 0.5F); }) == 0);
  const Scene scene = test::need(read_scene(Workshop().garment));
  OverlapBudget budget;
  CHECK(overlap_of(scene, {0}, 0, budget) == 0);  // its two triangles share an edge
  CHECK(overlap_of(scene, {0}, 1, budget) == 0);
  CHECK(overlap_of(scene, {0}, 7, budget) == 0);
}

TEST_CASE("dress: shared texture coordinates are told with their share") {
  Garment garment = test::square(2);
  garment.primitives[1].material = 0;
  const Workshop workshop(garment);
  const DressReport report = test::need(workshop.dress({.materials = {"#0"}}));
  CHECK(report.materials[0].size.shared.value() == doctest::Approx(1));
  REQUIRE(report.warnings.size() == 1);
  CHECK(report.warnings[0].find("100 % of its area shares its texture coordinates") != std::string::npos);
}

TEST_CASE("uv overlap: a mesh in two skins shares nothing with itself") {
  const Workshop workshop;
  Scene scene = test::need(read_scene(workshop.garment));
  scene.primitives.push_back(scene.primitives[0]);
  scene.instances.push_back({1, scene.instances[0].world});
  OverlapBudget budget;
  CHECK(overlap_of(scene, {0, 1}, 0, budget) == 0);
}

TEST_CASE("uv overlap: the budget is that of all materials, and beyond it nothing is said") {
  // Triangles over the whole grid: 1024 rows each.
  Scene scene = test::need(read_scene(Workshop().garment));
  std::vector<std::uint32_t>& indices = scene.primitives[0].indices;
  const std::vector<std::uint32_t> square = indices;
  for (int i = 1; i < 10000; ++i) indices.insert(indices.end(), square.begin(), square.end());
  OverlapBudget budget;
  int told = 0;
  while (const std::optional<double> share = overlap_of(scene, {0}, 0, budget)) {
    CHECK(*share == doctest::Approx(1));
    REQUIRE(++told < 10);
  }
  CHECK(told == 3);
}
