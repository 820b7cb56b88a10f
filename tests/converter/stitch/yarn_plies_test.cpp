#include "converter/stitch/yarn_plies.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/fabric/yarns.h"
#include "tests/converter/cells.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

StitchPattern laid(const StitchPattern& pattern) { return test::need(lay_plies(pattern, "test")); }

}  // namespace

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
