#include "converter/stitch/yarn_mesh.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "converter/light/ray_scene.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_plies.h"
#include "format/fabric/yarns.h"
#include "tests/converter/cells.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

CellMesh mesh_of(const StitchPattern& pattern) {
  auto mesh = test::need(mesh_stitch(pattern));
  CHECK(validate(mesh, pattern.name));
  return mesh;
}

void check_closed(const Topology& topology) {
  CHECK(topology.unpaired == 0);
  CHECK(topology.repeated == 0);
}

StitchPattern laid(const StitchPattern& pattern) { return test::need(lay_plies(pattern, "test")); }

/// A straight yarn of radius 0.5 mm in a cell of 4 mm.
StitchPattern hairy(double hairiness, double hair_mm, double loops) {
  StitchPattern pattern = cylinder(4, 0.5);
  pattern.yarns[0].fibre_kind = 2;
  pattern.yarns[0].hairiness = hairiness;
  pattern.yarns[0].hair_mm = hair_mm;
  pattern.yarns[0].hair_loops = loops;
  return pattern;
}

Hairs grown(const StitchPattern& pattern) { return test::need(mesh_stitch(pattern)).hairs; }

double length_of(const Hairs& hairs, std::size_t hair) {
  double length = 0;
  for (int k = 1; k < Hairs::points_per_hair; ++k) {
    const V3f* const point = &hairs.points[hair * Hairs::points_per_hair + k];
    length += static_cast<double>((point[0] - point[-1]).length());
  }
  return length;
}

}  // namespace

/// A regular polygon of 20 sides over the circle that it lies in.
const double polygon_perimeter = std::sin(std::numbers::pi / 20) / (std::numbers::pi / 20);
const double polygon_area = polygon_perimeter * std::cos(std::numbers::pi / 20);

TEST_CASE("area and volume of a ring are the torus's, but for the sides of a tube") {
  const CellMesh mesh = mesh_of(ring(4, 1.1, 0.53));
  const double area = 4 * std::numbers::pi * std::numbers::pi * 1.1 * 0.53;
  const double volume = 2 * std::numbers::pi * std::numbers::pi * 1.1 * 0.53 * 0.53;
  CHECK(area_of(mesh) == doctest::Approx(area * polygon_perimeter).epsilon(0.01));
  CHECK(volume_of(mesh) == doctest::Approx(volume * polygon_area).epsilon(0.01));
}

TEST_CASE("a ring's mesh is one closed surface with one hole") {
  const Topology topology = topology_of(mesh_of(ring(4, 1.1, 0.53)));
  check_closed(topology);
  CHECK(topology.components == 1);
  CHECK(topology.euler() == 0);
}

TEST_CASE("the built-in stitches tile without seam") {
  for (const StitchPattern& pattern : {plain_knit(), plain_weave(), find_stitch("rib")->pattern}) {
    CAPTURE(pattern.name);
    check_closed(topology_of(mesh_of(pattern)));
  }
}

TEST_CASE("tubes end as they begin: the same normals and albedo, whole periods away") {
  const CellMesh mesh = mesh_of(cylinder(4, 0.5));
  const std::size_t last = mesh.positions.size() - 20;
  for (std::size_t v = 0; v < 20; ++v) {
    const auto same = std::ranges::find(mesh.positions, mesh.positions[v] + V3f(4, 0, 0));
    REQUIRE(same != mesh.positions.end());
    const std::size_t copy = same - mesh.positions.begin();
    CHECK(copy >= last);
    CHECK(mesh.normals[copy] == mesh.normals[v]);
    CHECK(mesh.albedo[copy] == mesh.albedo[v]);
  }
}

TEST_CASE("vertices lie on the surface of their yarn, normals point out of it") {
  StitchPattern twill = find_stitch("twill", of_tubes({{"flattening", {0.6}}}))->pattern;
  for (Yarn& yarn : twill.yarns) yarn.radius_mm *= 0.8;
  for (const StitchPattern& pattern : {plain_weave(), ring(4, 1.1, 0.53), twill}) {
    CAPTURE(pattern.name);
    const CellMesh mesh = mesh_of(pattern);
    double farthest = 0;
    for (const V3f& p : mesh.positions)
      farthest = std::max(farthest, std::abs(distance_to_yarns(pattern, V3d(p))));
    CHECK(farthest < 1e-5);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const V3d normal(mesh.normals[mesh.triangles[t][k]]);
        CHECK(std::abs(normal.length() - 1) < 1e-6);
        CHECK(normal.dot(twice_area(mesh, t)) > 0);
      }
    }
  }
}

TEST_CASE("sizes are as in the paper, for every built-in stitch") {
  for (const StitchInfo& info : built_in_stitches()) {
    CAPTURE(info.name);
    const StitchPattern pattern = find_stitch(info.name, of_tubes())->pattern;
    const auto mesh = test::need(mesh_stitch(pattern));
    MESSAGE(info.name, ": ", mesh.positions.size(), " vertices, ", mesh.triangles.size(), " triangles");
    // Daubert et al. 2001, section 7: 1,300 to 23,000 vertices, 2,400 to 31,000 triangles.
    CHECK(mesh.positions.size() >= 1300);
    CHECK(mesh.positions.size() <= 23000);
    CHECK(mesh.triangles.size() >= 2400);
    CHECK(mesh.triangles.size() <= 31000);
  }
}

TEST_CASE("fibres run along the yarn, turned by its twist, and are there where a yarn is glossy") {
  StitchPattern pattern = cylinder(4, 0.5);
  CHECK(mesh_of(pattern).fibre_directions.empty());
  pattern.yarns[0].gloss = {0.3F, 0.2F};
  pattern.yarns[0].twist_per_mm = 0.25;
  const CellMesh mesh = mesh_of(pattern);
  REQUIRE(mesh.fibre_directions.size() == mesh.positions.size());
  for (std::size_t v = 0; v < mesh.fibre_directions.size(); ++v) {
    CHECK(mesh.gloss[v] == Gloss{0.3F, 0.2F});
    const V3d fibre(mesh.fibre_directions[v]);
    CHECK(std::abs(fibre.dot(V3d(mesh.normals[v]))) < 1e-5);
    // A helix of radius r and f turns per mm climbs by atan(2 pi r f).
    const double angle = std::atan(2 * std::numbers::pi * 0.5 * 0.25);
    CHECK(fibre.x == doctest::Approx(std::cos(angle)).epsilon(1e-4));
    // Z-twist is a right-handed screw: from the top of the yarn (+z) on towards +x it turns to the right
    // (-y).
    if (mesh.normals[v].z > 0.9F) CHECK(fibre.y < 0);
  }
}

TEST_CASE("plies make a mesh that is closed round the torus of cells, with fibres along them") {
  StitchPattern pattern = cylinder(4, 0.6);
  pattern.yarns[0].plies = 3;
  pattern.yarns[0].twist_per_mm = 0.25;
  pattern.yarns[0].gloss.weight = 0.1F;
  const CellMesh mesh = mesh_of(pattern);
  check_closed(topology_of(mesh));
  REQUIRE(mesh.fibre_directions.size() == mesh.positions.size());
  // Helices at offset a climb by atan(2 pi a f).
  const double offset = 0.6 * (1 - std::sin(std::numbers::pi / 3) / (1 + std::sin(std::numbers::pi / 3)));
  const double cosine = std::cos(std::atan(2 * std::numbers::pi * offset * 0.25));
  for (const V3f& fibre : mesh.fibre_directions)
    CHECK(std::abs(fibre.x) == doctest::Approx(cosine).epsilon(0.01));
}

TEST_CASE("a surface alone is the one of the mesh, and of whole yarns where there are many plies") {
  const CellMesh surface = test::need(mesh_stitch(plain_knit(), false));
  CHECK(surface.positions == test::need(mesh_stitch(plain_knit())).positions);
  CHECK((surface.yarns.curves.empty() && surface.yarn_places.empty() && surface.hairs.points.empty()));
  StitchPattern many = test::need(find_stitch("rib-2x2")).pattern;
  CHECK(!hides_plies(many));
  many = repeat_pattern(many, 20);
  REQUIRE(hides_plies(many));
  const CellMesh coarse = test::need(mesh_stitch(many, false));
  // Some 30 rings of 6 sides a loop.
  CHECK(coarse.triangles.size() <= std::size_t{20 * 20 * 4 * 400});
  CHECK(coarse.triangles.size() >= std::size_t{20 * 20 * 4 * 200});
}

TEST_CASE("fibres lean to their ply, of the other hand than the twist, and hairs are shared out") {
  for (const double twist : {0.5, -0.5}) {
    StitchPattern pattern = cylinder(4, 0.5);
    pattern.yarns[0].plies = 2;
    pattern.yarns[0].twist_per_mm = twist;
    pattern.yarns[0].fibre_degrees = 20;
    pattern.yarns[0].hairiness = 8;
    pattern.yarns[0].hair_mm = 1;
    double hair = 0;
    for (const Yarn& ply : laid(pattern).yarns) {
      const double slope = 2 * std::numbers::pi * ply.radius_mm * ply.twist_per_mm;
      CHECK(slope ==
            doctest::Approx(twist > 0 ? -std::tan(std::numbers::pi / 9) : std::tan(std::numbers::pi / 9)));
      for (const BezierSegment& s : ply.segments) hair += ply.hairiness * (s[3] - s[0]).length();
    }
    CHECK(hair == doctest::Approx(8 * 4));
  }
}

TEST_CASE("turns are rounded so that every ply runs on into a ply of the next repeat") {
  StitchPattern pattern = cylinder(4, 0.5);
  pattern.yarns[0].plies = 3;
  pattern.yarns[0].twist_per_mm = 0.34;  // 1.36 turns a repeat, so 4/3: plies change places
  const StitchPattern plies = laid(pattern);
  REQUIRE(plies.yarns.size() == 1);
  CHECK(chain_periods(plies.yarns[0], plies.period_mm) == V2i(3, 0));
  pattern.yarns[0].twist_per_mm = 0.1;  // 0.4 turns, so 1/3
  CHECK(laid(pattern).yarns.size() == 1);
  pattern.yarns[0].twist_per_mm = 0;
  CHECK(laid(pattern).yarns.size() == 3);
}

TEST_CASE("plies that a file derives from their axis lie where the mesh has them") {
  for (const char* name : {"rib", "lace", "twill"}) {
    CAPTURE(name);
    StitchPattern pattern = find_stitch(name, of_tubes())->pattern;
    for (Yarn& yarn : pattern.yarns) {
      yarn.plies = 3;
      yarn.twist_per_mm = 0.1 / yarn.radius_mm;
      if (name == std::string("twill") || name == std::string("rib")) yarn.flattening = 0.7;
    }
    const YarnData data = test::need(yarn_curves_of(pattern));
    REQUIRE(data.curves.size() == pattern.yarns.size());  // none had to be laid as chains
    const StitchPattern plies = laid(pattern);
    std::vector<V3d> points;
    for (const Yarn& ply : plies.yarns)
      for (const BezierSegment& segment : ply.segments)
        for (int k = 0; k < 40; ++k) points.push_back(point_at(segment, k / 40.0));
    double worst = 0;
    for_each_curve(data, [&](std::size_t, const YarnCurve& curve, std::span<const V3f> nodes) {
      const auto segments = make_segments(curve, nodes, V2f(pattern.period_mm));
      for (std::size_t i = 0; i < segments.size(); i += 7) {
        double nearest = 1e9;
        for (const V3d& point : points) {
          V3d off = point - V3d(segments[i].start);
          for (int k = 0; k < 2; ++k)
            off[k] -= std::round(off[k] / pattern.period_mm[k]) * pattern.period_mm[k];
          nearest = std::min(nearest, off.length() / static_cast<double>(ply_or_yarn_radius(curve)));
        }
        worst = std::max(worst, nearest);
      }
    });
    MESSAGE(std::string(name), ": ", worst);
    CHECK(worst < 0.03);
  }
}

TEST_CASE("rays to the hairs of the mesh meet the hairs of a file's yarn") {
  // Plies, and thick hairs that let nothing pass, so that a ray to a hair's middle meets it.
  StitchPattern pattern = hairy(20, 0.4, 0.3);
  pattern.yarns[0].plies = 2;
  pattern.yarns[0].twist_per_mm = 0.25;
  pattern.yarns[0].irregularity = 0.1;
  CellMesh mesh = test::need(mesh_stitch(pattern));
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
  CHECK(mesh_stitch(cylinder(4, 0.5))->hairs.points.empty());
  CHECK(to_line(test::error_of(mesh_stitch(hairy(90, 1e-3, 0)))) ==
        "cylinder: /yarns/0/hairiness: the repeat would have more than 100000 hairs [MESH_INVALID]");
}
