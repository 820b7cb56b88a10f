#include "samples/band.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "format/scene/flatten.h"
#include "tests/samples/garment_checks.h"

namespace selvedge::samples {
namespace {

constexpr int around = 32;

/// A tube of radius 0.1 m, 0.2 m high; its lowest row of four (0.05 m) carries the label 1.
QuadSurface tube() {
  QuadSurface surface;
  for (int i = 0; i <= 4; ++i) {
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * std::numbers::pi * k / around;
      surface.positions.emplace_back(0.1 * std::sin(angle), 0.05 * i, 0.1 * std::cos(angle));
    }
  }
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < around; ++k) {
      const int next = (k + 1) % around;
      surface.quads.push_back(
          {around * i + k, around * i + next, around * (i + 1) + next, around * (i + 1) + k});
      surface.labels.push_back(i == 0 ? 1 : 0);
    }
  }
  return surface;
}

TEST_CASE("peels the labelled rows, the seam first") {
  const Rings rings = peel(tube(), 1, V3d(0, 0, -1));
  REQUIRE(rings.size() == 2);
  CHECK(rings.front()[0] == around + around / 2);  // the seam's point that lies farthest back
  CHECK(rings.back()[0] == around / 2);
  CHECK(std::set<int>(rings.front().begin(), rings.front().end()).size() == around);
}

TEST_CASE("a band is one strip with a seam and an edge, and keeps its stitches' size") {
  const QuadSurface surface = tube();
  const Rings rings = peel(surface, 1, V3d(0, 0, -1));
  Assembly assembly;
  assembly.points = surface.positions;
  add_band(assembly, rings, "trim", {});
  REQUIRE(assembly.patches.size() == 1);
  CHECK(count_boundary_loops(assembly) == 2);

  const Patch& band = assembly.patches[0];
  double area = 0;
  double kept = 0;
  for (const V3i& t : band.triangles) {
    std::array<V3d, 3> corners;
    std::array<V2d, 3> plane;
    for (int k = 0; k < 3; ++k) {
      const std::size_t v = static_cast<std::size_t>(t[k]);
      corners[k] = assembly.points[band.points[v]];
      plane[k] = band.tex_coords[v];
    }
    CHECK((plane[1] - plane[0]) % (plane[2] - plane[0]) < 0);  // u right, v down
    const double size = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length();
    const Stretch stretch = stretch_of(corners, plane);
    area += size;
    if (stretch.most < 1.1 && stretch.least > 0.9) kept += size;
  }
  // The turned edge, where ribs run out and the inner side is shorter, is what is left.
  CHECK(kept > 0.75 * area);
}

}  // namespace
}  // namespace selvedge::samples
