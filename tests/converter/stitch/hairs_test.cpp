#include "converter/stitch/hairs.h"

#include <doctest/doctest.h>

#include <cmath>

#include "converter/stitch/fibres.h"
#include "converter/stitch/implicit_surface.h"
#include "converter/stitch/yarn_mesh.h"
#include "tests/converter/cells.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

/// A straight yarn of radius 0.5 mm in a cell of 4 mm.
StitchPattern hairy(double hairiness, double hair_mm, double loops) {
  StitchPattern pattern = cylinder(4, 0.5);
  pattern.yarns[0].fibre = 2;
  pattern.yarns[0].hairiness = hairiness;
  pattern.yarns[0].hair_mm = hair_mm;
  pattern.yarns[0].hair_loops = loops;
  return pattern;
}

Hairs grown(const StitchPattern& pattern) { return test::need(mesh_stitch(pattern, {32})).hairs; }

double length_of(const Hairs& hairs, std::size_t hair) {
  double length = 0;
  for (int k = 1; k < Hairs::points_each; ++k) {
    const V3f* const point = &hairs.points[hair * Hairs::points_each + k];
    length += static_cast<double>((point[0] - point[-1]).length());
  }
  return length;
}

}  // namespace

TEST_CASE("hairs are as long together as the hairiness says, and exponential up to three times their mean") {
  const Hairs hairs = grown(hairy(90, 0.3, 0));
  double sum = 0;
  double longest = 0;
  std::size_t short_ones = 0;
  for (std::size_t h = 0; h < hairs.roots.size(); ++h) {
    const double length = length_of(hairs, h);
    sum += length;
    longest = std::max(longest, length);
    short_ones += length < 0.3 * std::log(2.0);
  }
  const auto count = static_cast<double>(hairs.roots.size());
  // About 1,400 hairs: the standard error of the sum is 2 %.
  CHECK(sum == doctest::Approx(90 * 4).epsilon(0.06));
  CHECK(longest <= 0.9 * 1.0001);
  CHECK(longest > 0.8);
  // Half of an exponential distribution lies below log 2 of its mean, and more of one that is cut.
  CHECK(static_cast<double>(short_ones) / count == doctest::Approx(0.5 / (1 - std::exp(-3.0))).epsilon(0.06));
  CHECK(hairs.radius[0] == doctest::Approx(0.0115));
  CHECK(static_cast<double>(hairs.passed[0]) == doctest::Approx(forward_share(yarn_kinds()[2].refraction)));
}

TEST_CASE("hairs leave the surface to the outside, and loops return to it") {
  for (const double loops : {0.0, 1.0}) {
    const StitchPattern pattern = hairy(20, 0.5, loops);
    const auto surface = test::need(ImplicitSurface::build(pattern, 2, ""));
    const Hairs hairs = grown(pattern);
    REQUIRE(hairs.roots.size() > 100);
    for (std::size_t h = 0; h < hairs.roots.size(); ++h) {
      const V3f* const point = &hairs.points[h * Hairs::points_each];
      CHECK(std::abs(surface.distance(V3d(point[0]))) < 0.02);
      CHECK(surface.distance(V3d(point[2])) > surface.distance(V3d(point[0])));
      if (loops == 1) CHECK(std::abs(surface.distance(V3d(point[Hairs::points_each - 1]))) < 0.02);
    }
  }
}

TEST_CASE("the same seed grows the same hairs, another one others, and too many are refused") {
  StitchPattern pattern = hairy(8, 0.5, 0.3);
  const Hairs first = grown(pattern);
  CHECK(grown(pattern).points == first.points);
  pattern.seed = 2;
  CHECK(grown(pattern).points != first.points);
  CHECK(mesh_stitch(cylinder(4, 0.5), {32})->hairs.points.empty());
  CHECK(to_line(test::error_of(mesh_stitch(hairy(90, 1e-3, 0), {32}))) ==
        "cylinder: /yarns/0/hairiness: the repeat would have more than 100000 hairs [MESH_INVALID]");
}
