#include "converter/stitch/yarn_mesh.h"

#include <doctest/doctest.h>

#include <cmath>

#include "converter/light/ray_scene.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/implicit_surface.h"
#include "tests/converter/cells.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

/// A straight yarn of radius 0.5 mm in a cell of 4 mm.
StitchPattern hairy(double hairiness, double hair_mm, double loops) {
  StitchPattern pattern = cylinder(4, 0.5);
  pattern.yarns[0].fibre_kind = 2;
  pattern.yarns[0].hairiness = hairiness;
  pattern.yarns[0].hair_mm = hair_mm;
  pattern.yarns[0].hair_loops = loops;
  return pattern;
}

Hairs grown(const StitchPattern& pattern) { return test::need(mesh_stitch(pattern, {32})).hairs; }

double length_of(const Hairs& hairs, std::size_t hair) {
  double length = 0;
  for (int k = 1; k < Hairs::points_per_hair; ++k) {
    const V3f* const point = &hairs.points[hair * Hairs::points_per_hair + k];
    length += static_cast<double>((point[0] - point[-1]).length());
  }
  return length;
}

}  // namespace

TEST_CASE("rays to the hairs of the mesh meet the hairs of a file's yarn") {
  // Plies, and thick hairs that let nothing pass, so that a ray to a hair's middle meets it.
  StitchPattern pattern = hairy(20, 0.4, 0.3);
  pattern.yarns[0].plies = 2;
  pattern.yarns[0].twist_per_mm = 0.25;
  pattern.yarns[0].irregularity = 0.1;
  CellMesh mesh = test::need(mesh_stitch(pattern, {32}));
  for (float& radius : mesh.hairs.radius) radius = 0.03F;
  for (float& passed : mesh.hairs.transparency) passed = 0;
  YarnData data = mesh.yarns;
  REQUIRE(data.curves.size() == 1);
  data.curves[0].hairs.radius = 0.03F;
  data.curves[0].hairs.opacity = 1;
  data.station_light.assign(std::size_t{light_values_per_station} * data.curves[0].stations, 0);
  const V2f period(mesh.period);
  const Yarns yarns(data, period);
  const auto scene = test::need(RayScene::create(mesh, "hairy"));
  int met = 0;
  int same = 0;
  for (std::size_t h = 0; h < mesh.hairs.root_triangles.size(); ++h) {
    for (int k = 1; k < Hairs::points_per_hair - 1; ++k) {
      const V3f* const points = &mesh.hairs.points[h * Hairs::points_per_hair];
      const V3f aim = (points[k] + points[k + 1]) * 0.5F;
      SurfacePoint point;
      if (!scene.trace({aim.x, aim.y, 10}, {0, 0, -1}, point)) continue;
      if (point.hair_point < 0) continue;
      const auto hit = yarns.trace(
          V2d(static_cast<double>(aim.x / period.x), static_cast<double>(-aim.y / period.y)), 0, {0, 0, 1});
      ++met;
      same += hit && yarns.geometry().segments[hit->segment].hair_threshold > 0 ? 1 : 0;
    }
  }
  MESSAGE(same, " of ", met);
  CHECK(met > 300);
  // Ribbons of the mesh are wider and narrower than round hairs, so that some hide others, or yarn does.
  CHECK(same > 0.97 * met);
}

TEST_CASE("hairs are as long together as the hairiness says, and exponential up to three times their mean") {
  const Hairs hairs = grown(hairy(90, 0.3, 0));
  double sum = 0;
  double longest = 0;
  std::size_t short_ones = 0;
  for (std::size_t h = 0; h < hairs.root_triangles.size(); ++h) {
    const double length = length_of(hairs, h);
    sum += length;
    longest = std::max(longest, length);
    short_ones += length < 0.3 * std::log(2.0);
  }
  const auto count = static_cast<double>(hairs.root_triangles.size());
  // About 1,400 hairs: the standard error of the sum is 2 %.
  CHECK(sum == doctest::Approx(90 * 4).epsilon(0.06));
  CHECK(longest <= 0.9 * 1.0001);
  CHECK(longest > 0.8);
  // Half of an exponential distribution lies below log 2 of its mean, and more of one that is cut.
  CHECK(static_cast<double>(short_ones) / count == doctest::Approx(0.5 / (1 - std::exp(-3.0))).epsilon(0.06));
  CHECK(hairs.radius[0] == doctest::Approx(0.0115));
  CHECK(static_cast<double>(hairs.transparency[0]) ==
        doctest::Approx(forward_transmitted_fraction(yarn_kinds()[2].refractive_index)));
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
