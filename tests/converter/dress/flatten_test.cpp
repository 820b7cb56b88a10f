#include "converter/dress/flatten.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "tests/converter/dress/flat_stretch.h"

namespace selvedge {
namespace {

using test::Stretch;
using test::stretch_of;

/// A grid of triangles over (a, b) in [0, 1]^2, bent by `place`.
template <class PrimitiveIndex>
ClothPanel bend(int columns, int rows, const PrimitiveIndex& place) {
  ClothPanel panel;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      panel.positions.push_back(place(static_cast<double>(i) / columns, static_cast<double>(j) / rows));
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const int a = j * (columns + 1) + i;
      panel.triangles.emplace_back(a, a + 1, a + columns + 2);
      panel.triangles.emplace_back(a, a + columns + 2, a + columns + 1);
    }
  }
  return panel;
}

Stretch worst_of(const ClothPanel& panel, const std::vector<V2d>& plane) {
  Stretch worst;
  for (const V3i& t : panel.triangles) {
    std::array<V3d, 3> corners;
    std::array<V2d, 3> flat;
    for (int k = 0; k < 3; ++k) {
      corners[k] = panel.positions[t[k]];
      flat[k] = plane[t[k]];
    }
    const Stretch s = stretch_of(corners, flat);
    worst.max = std::max(worst.max, s.max);
    worst.min = std::min(worst.min, s.min);
  }
  return worst;
}

TEST_CASE("half a tube is unrolled without stretch") {
  // A tube of flat facets can be unrolled exactly: what is left is the solver's rounding.
  const ClothPanel panel = bend(24, 16, [](double a, double b) {
    return V3d(-0.1 * std::cos(std::numbers::pi * a), 0.4 * b, 0.1 * std::sin(std::numbers::pi * a));
  });
  const std::vector<V2d> plane = flatten(panel);
  const Stretch worst = worst_of(panel, plane);
  CHECK(worst.max < 1 + 1e-6);
  CHECK(worst.min > 1 - 1e-6);
}

TEST_CASE("a cap of a sphere is stretched no more than its curvature asks for") {
  // Radius 1, 0.5 x 0.5: the way along an edge and through the middle differ by about r^2 / 8 = 3 %.
  const ClothPanel panel = bend(20, 20, [](double a, double b) {
    const double x = 0.5 * a - 0.25;
    const double y = 0.5 * b - 0.25;
    return V3d(x, y, std::sqrt(1 - x * x - y * y));
  });
  const std::vector<V2d> plane = flatten(panel);
  const Stretch worst = worst_of(panel, plane);
  CHECK(worst.max < 1.04);
  CHECK(worst.min > 0.96);
  CHECK(worst.max - worst.min > 0.005);  // Gauss: it cannot be none
}

TEST_CASE("the flat panel keeps the outside up") {
  const ClothPanel panel = bend(4, 4, [](double a, double b) { return V3d(a, b, 0.1 * a * b); });
  const std::vector<V2d> plane = flatten(panel);
  for (const V3i& t : panel.triangles) {
    const V2d& a = plane[t[0]];
    CHECK((plane[t[1]] - a) % (plane[t[2]] - a) > 0);
  }
}

}  // namespace
}  // namespace selvedge
