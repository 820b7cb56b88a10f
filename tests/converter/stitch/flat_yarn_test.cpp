#include "converter/stitch/flat_yarn.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "converter/light/ray_scene.h"
#include "converter/stitch/clearance.h"
#include "converter/stitch/library.h"
#include "converter/stitch/textile.h"
#include "converter/stitch/weave.h"
#include "converter/stitch/yarn_mesh.h"
#include "converter/stitch/yarn_relax.h"
#include "tests/converter/cells.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

constexpr double pi = std::numbers::pi;

/// A built-in stitch, laid and measured once for all tests.
const auto& built_in(const std::string& name) {
  static std::map<std::string, std::pair<FoundStitch, TextileNumbers>> all;
  const auto [known, is_new] = all.try_emplace(name);
  if (is_new) {
    FoundStitch found = test::need(find_stitch(name));
    TextileNumbers numbers = test::need(textile_numbers(found.pattern, found.stitch_count));
    known->second = {std::move(found), std::move(numbers)};
  }
  return known->second;
}

/// Perimeter of an ellipse of the semi-axes a and b: the arithmetic-geometric mean (Gauss; Abramowitz and
/// Stegun 17.6).
double perimeter_of(double a, double b) {
  double sum = 0.5 * (a * a + b * b);
  double power = 0.5;
  while (a - b > 1e-15) {
    const double c = 0.5 * (a - b);
    const double mean = 0.5 * (a + b);
    b = std::sqrt(a * b);
    a = mean;
    power *= 2;
    sum -= power * c * c;
  }
  return 2 * pi * sum / a;
}

StitchPattern woven(double radius, double flattening) {
  Yarn yarn{.radius_mm = radius, .flattening = flattening};
  return draw_weave({{yarn, yarn}, {yarn, yarn}, {1, 1}, {1, 1}, {true, false, false, true}}, "woven");
}

/// The least of the other yarns' surfaces' distance from points of every yarn's section, which are placed by
/// the ellipse's own parameters.
double min_between(const StitchPattern& pattern) {
  double least = 1e9;
  for (std::size_t own = 0; own < pattern.yarns.size(); ++own) {
    StitchPattern others = pattern;
    others.yarns.erase(others.yarns.begin() + static_cast<long>(own));
    const Yarn& yarn = pattern.yarns[own];
    for (const BezierSegment& segment : yarn.segments) {
      const V3d tangent = derivative_at(segment, 0.5).normalized();
      const V3d level = V3d(tangent.y, -tangent.x, 0).normalized();
      const V3d up = level.cross(tangent);
      const double fraction = 1 - (1 - yarn.flattening) * (1 - std::pow(tangent.z, 4));
      for (int k = 0; k < 64; ++k) {
        const double angle = 2 * pi * k / 64;
        const V3d off =
            level * (std::cos(angle) / std::sqrt(fraction)) + up * (std::sin(angle) * std::sqrt(fraction));
        least = std::min(least, distance_to_yarns(others, point_at(segment, 0.5) + off * yarn.radius_mm));
      }
    }
  }
  return least;
}

}  // namespace

TEST_CASE(
    "the mesh of a straight squashed yarn lies on the ellipse, with its area and perimeter, whichever way it "
    "leans") {
  for (const double angle : {0.0, 0.4, 1.1, pi / 2, 2.5}) {
    CAPTURE(angle);
    constexpr double q = 0.4;
    const double a = 0.6 / std::sqrt(q);
    const double b = 0.6 * std::sqrt(q);
    StitchPattern pattern = cylinder(4, 0.6);
    const V3d along(0, std::cos(angle), std::sin(angle));
    // The same section all along, also where the sign changes.
    for (std::size_t s = 0; s < pattern.yarns[0].segments.size(); ++s)
      pattern.yarns[0].squeezes.push_back(along * std::sqrt(1 - q) * (s % 2 == 0 ? 1 : -1));
    const CellMesh mesh = test::need(mesh_stitch(pattern));
    const double high = std::hypot(a * along.z, b * along.y);
    for (const V3f& p : mesh.positions) {
      const V3d off(0, static_cast<double>(p.y) - 2, static_cast<double>(p.z));
      const V3d across(0, -along.z, along.y);
      CHECK(std::hypot(off.dot(along) / a, off.dot(across) / b) == doctest::Approx(1).epsilon(1e-5));
    }
    // Affine images of a regular polygon of 20 sides.
    CHECK(volume_of(mesh) == doctest::Approx(4 * 0.36 * 10 * std::sin(pi / 10)).epsilon(1e-4));
    CHECK(area_of(mesh) ==
          doctest::Approx(4 * perimeter_of(a, b) * std::sin(pi / 20) / (pi / 20)).epsilon(1e-3));
    // Level -1 reaches as high.
    YarnData data = test::need(yarn_curves_of(pattern));
    data.station_light.assign(std::size_t{light_values_per_station} * data.curves[0].stations, 0);
    const Yarns yarns(std::move(data), V2f(pattern.period_mm));
    CHECK(static_cast<double>(yarns.geometry().max_z - yarns.geometry().min_z) ==
          doctest::Approx(2 * high).epsilon(5e-3));
  }
}

TEST_CASE("mesh and level -1 have the same flat yarn: rays meet both at the same height") {
  for (const auto& [name, plies, kind] :
       {std::tuple("herringbone", 1, 0.0), std::tuple("twill", 3, 0.0), std::tuple("rib-2x2", 1, 2.0)}) {
    CAPTURE(plies);
    StitchPattern pattern =
        test::need(find_stitch(name, kind > 0 ? StitchSettings{{"radius_mm", {0.75}}}
                                              : StitchSettings{{"flattening", {0.6}}, {"yarn", {0}}}))
            .pattern;
    for (Yarn& yarn : pattern.yarns) {
      yarn.hairiness = yarn.irregularity = 0;
      yarn.plies = plies;
      yarn.twist_per_mm = 0.1 / yarn.radius_mm;
      yarn.radius_mm *= 0.8;
    }
    const CellMesh mesh = test::need(mesh_stitch(pattern));
    const RayScene scene = test::need(RayScene::create(mesh, name));
    const float low = bounds_of(mesh).min.z;
    YarnData data = test::need(yarn_curves_of(pattern));
    const float up = mesh.yarns.nodes[0].z - data.nodes[0].z;
    for (V3f& node : data.nodes) node.z += up;
    int stations = 0;
    for (const YarnCurve& curve : data.curves) stations += curve.stations;
    data.station_light.assign(std::size_t{light_values_per_station} * stations, 0);
    const Yarns yarns(std::move(data), V2f(mesh.period));
    std::vector<float> apart;
    std::vector<float> turned;
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
      if (!(mesh.normals[v].z > 0.5F)) continue;
      const V3f& at = mesh.positions[v];
      SurfacePoint seen;
      REQUIRE(scene.trace({at.x, at.y, 10}, {0, 0, -1}, seen));
      if (seen.position.z > at.z - low + 1e-3F) continue;  // another yarn lies above
      const auto hit = yarns.trace({at.x / mesh.period.x, -at.y / mesh.period.y}, 0, {0, 0, 1});
      REQUIRE(hit);
      const float above = yarns.geometry().segments[hit->segment].start.z + hit->start_offset.z - at.z;
      apart.push_back(std::abs(above));
      turned.push_back((yarns.point_at(*hit).normal - mesh.normals[v]).length());
    }
    REQUIRE(apart.size() > 800);
    std::sort(apart.begin(), apart.end());
    std::sort(turned.begin(), turned.end());
    const auto of_share = [](const std::vector<float>& sorted, double fraction) {
      return sorted[static_cast<std::size_t>(fraction * static_cast<double>(sorted.size()))];
    };
    MESSAGE(plies, " plies: apart ", of_share(apart, 0.97), ", turned ", of_share(turned, 0.5), " ",
            of_share(turned, 0.97));
    // Sections of squashed yarn change by steps from segment to segment.
    CHECK(of_share(apart, 0.97) < (kind > 0 ? 0.01 : 0.004));
    CHECK(of_share(turned, 0.5) < (kind > 0 ? 0.01 : 0.005));
    // Steep places; nodes half as far apart leave it as it is.
    CHECK(of_share(turned, 0.97) < 0.1);
  }
}

TEST_CASE("relaxed flat yarns lie on each other and do not overlap") {
  for (const double q : {0.4, 0.7}) {
    CAPTURE(q);
    const StitchPattern relaxed = relax(woven(0.25, q)).pattern;
    const double thin = relaxed.yarns[0].radius_mm * std::sqrt(q);
    for (std::size_t i = 0; i < 2; ++i)
      for (const Crossing& c : crossings_of(relaxed, relaxed.yarns[i], relaxed.yarns[2]))
        CHECK(std::abs(c.z_a - c.z_b) == doctest::Approx(2 * thin).epsilon(0.03));
    const double least = min_between(relaxed);
    MESSAGE(q, ": ", least / thin);
    CHECK(least > -touching_overlap * thin);
    CHECK(least < 0.1 * thin);
    CHECK(std::abs(*minimum_clearance(relaxed, "")) < touching_overlap * 0.25);
  }
}

TEST_CASE("squashed yarn closes weaves: it keeps its area, and covers more than round yarn") {
  for (const char* name : {"plain-weave", "twill", "herringbone", "denim", "satin", "basket"}) {
    CAPTURE(name);
    const auto& [found, numbers] = built_in(name);
    const StitchPattern& pattern = found.pattern;
    const double overlap = -test::need(minimum_clearance(pattern, "")) / min_half_thickness(pattern);
    CHECK(overlap <= touching_overlap);
    CHECK(numbers.cover_fraction >= 0.985);
    // Tubes are rigid and round, or as flat as they are told to be.
    const StitchPattern tubes = test::need(find_stitch(name, {{"yarn", {0}}})).pattern;
    CHECK(numbers.cover_fraction > std::min(0.999, test::need(textile_numbers(tubes, 0)).cover_fraction));
    CHECK(tubes.yarns.front().squeezes.empty());
    CHECK(tubes.yarns.front().flattening == 1);
  }
  const StitchSettings flatter{{"yarn", {0}}, {"weft_flattening", {0.9}}, {"flattening", {0.6}}};
  const StitchPattern flat = test::need(find_stitch("plain-weave", flatter)).pattern;
  CHECK(flat.yarns.front().squeezes.empty());
  CHECK(flat.yarns.front().flattening == 0.6);
  // Settings stay.
  const auto twill = test::need(find_stitch("twill", {{"warp_radius_mm", {0.34}}}));
  CHECK(twill.pattern.yarns.front().radius_mm == doctest::Approx(0.34));
}

TEST_CASE("shirtings come to rest at their counts, without being thinned, and weigh as much as is sold") {
  struct Shirting {
    const char* name;
    double warp_tex, weft_tex, min_weight, max_weight;
  };
  // The files have the sources.
  for (const auto& [name, warp, weft, least, most] :
       {Shirting{"poplin", 14.8, 14.8, 110, 145}, Shirting{"oxford", 14.8, 49, 140, 175}}) {
    CAPTURE(name);
    const FoundStitch found =
        test::need(find_stitch(fmt::format("{}/samples/drafts/{}.wif", SELVEDGE_SOURCE_DIR, name)));
    const auto numbers = test::need(textile_numbers(found.pattern, 0));
    CHECK(found.thickness_fraction == 1);
    CHECK(numbers.tex.front() == doctest::Approx(warp).epsilon(0.02));
    CHECK(numbers.tex.back() == doctest::Approx(weft).epsilon(0.02));
    CHECK(numbers.weight_g_per_m2 > least);
    CHECK(numbers.weight_g_per_m2 < most);
    CHECK(numbers.cover_fraction > 0.9);
  }
}

TEST_CASE(
    "built-in stitches weigh as much, and are as thick, as such cloth, and cover as much as they state") {
  // Sources of the ranges: spec/stitch.md, Textile numbers.
  struct Cloth {
    const char* name;
    double min_tex, max_tex, min_weight, max_weight, min_mm, max_mm;
  };
  const std::vector<Cloth> cloths{
      {"plain-knit", 413, 620, 510, 760, 1.8, 4}, {"purl", 413, 620, 510, 760, 1.8, 4},
      {"rib", 413, 620, 680, 1520, 3.6, 8},       {"rib-2x2", 413, 620, 638, 1382, 3.6, 8},
      {"garter", 261, 550, 400, 760, 3, 7},       {"two-colour", 413, 620, 510, 760, 1.8, 4},
      {"lace", 261, 550, 200, 400, 1.5, 4},       {"plain-weave", 100, 300, 240, 610, 0.5, 1.4},
      {"twill", 148, 394, 400, 712, 0.8, 2},      {"herringbone", 130, 300, 380, 520, 0.8, 2},
      {"denim", 148, 394, 407, 712, 0.7, 1.7},    {"satin", 100, 204, 250, 600, 0.6, 1.5},
      {"basket", 100, 330, 300, 600, 0.6, 1.7}};
  CHECK(cloths.size() == built_in_stitches().size());
  for (std::size_t i = 0; i < cloths.size(); ++i) {
    const StitchInfo info = built_in_stitches()[i];
    const Cloth& cloth = cloths[i];
    CAPTURE(info.name);
    CHECK(info.name == cloth.name);
    const auto& [found, numbers] = built_in(info.name);
    MESSAGE(info.name, ": ", numbers.tex[0], " tex, ", numbers.weight_g_per_m2, " g/m2, ",
            numbers.thickness_mm, " mm, ", numbers.tightness);
    CHECK(info.cover_fraction == doctest::Approx(numbers.cover_fraction).epsilon(0.002));
    for (const double tex : numbers.tex) {
      CHECK(tex >= cloth.min_tex);
      CHECK(tex <= cloth.max_tex);
    }
    CHECK(numbers.weight_g_per_m2 >= cloth.min_weight);
    CHECK(numbers.weight_g_per_m2 <= cloth.max_weight);
    CHECK(numbers.thickness_mm >= cloth.min_mm);
    CHECK(numbers.thickness_mm <= cloth.max_mm);
    if (found.stitch_count > 0) CHECK(numbers.tightness == doctest::Approx(14).epsilon(0.36));  // 9 to 19
  }
}

TEST_CASE("knits are of textile numbers, and squashed yarn covers them") {
  struct Knit {
    const char* name;
    double min_cover, max_cover, min_with_hairs;
  };
  for (const auto& [name, least, most, with_hairs] :
       {Knit{"plain-knit", 0.88, 1, 0.91}, Knit{"rib", 0.88, 1, 0.93}, Knit{"garter", 0.88, 1, 0.93},
        Knit{"lace", 0.6, 0.85, 0.6}}) {
    CAPTURE(name);
    const auto& [found, numbers] = built_in(name);
    const Yarn& yarn = found.pattern.yarns[0];
    CHECK(numbers.cover_fraction >= least);
    CHECK(numbers.cover_fraction <= most);
    // Round yarn covers less; ribs of it draw in by another width.
    if (name != std::string_view("rib")) {
      const auto round = test::need(find_stitch(name, {{"yarn", {0}}}));
      CHECK(test::need(textile_numbers(round.pattern, found.stitch_count)).cover_fraction <
            numbers.cover_fraction);
    }
    CHECK(numbers.cover_fraction_with_hairs >= std::max(numbers.cover_fraction, with_hairs));
    CHECK(-test::need(minimum_clearance(found.pattern, "")) <= touching_overlap * yarn.radius_mm);
    for (const V3d& squeeze : yarn.squeezes) CHECK(squeeze.length2() <= 0.7 + 1e-6);
  }
  // From its count, packing and tightness: 500 tex, 0.4 of wool.
  const auto knit =
      test::need(find_stitch("plain-knit", {{"tex", {500}}, {"packing", {0.4}}, {"tightness", {12}}}));
  CHECK(knit.pattern.yarns[0].radius_mm == doctest::Approx(10 * std::sqrt(500e-5 / (1.31 * 0.4 * pi))));
  const auto numbers = test::need(textile_numbers(knit.pattern, knit.stitch_count));
  CHECK(numbers.tex[0] == doctest::Approx(500));
  CHECK(numbers.tightness == doctest::Approx(12).epsilon(0.1));
  double length = 0;
  for (const BezierSegment& s : knit.pattern.yarns[0].segments) length += polygon_length(s);
  CHECK(numbers.weight_g_per_m2 ==
        doctest::Approx(500 * length / (knit.pattern.period_mm.x * knit.pattern.period_mm.y)));
  for (const StitchSettings& extreme :
       {StitchSettings{{"tex", {1e6}}, {"tightness", {5}}},
        StitchSettings{{"tex", {0.1}}, {"packing", {1}}, {"tightness", {40}}},
        StitchSettings{{"tex", {1}}, {"packing", {0.05}}, {"tightness", {5}}},
        StitchSettings{{"tightness", {15}}}, StitchSettings{{"tex", {500}}, {"radius_mm", {0.5}}}}) {
    const auto made = find_stitch("plain-knit", extreme);
    if (made) CHECK(validate(made->pattern, ""));
    if (!made) CHECK(made.error().code == Code::option_out_of_range);
  }
}
