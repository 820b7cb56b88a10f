#include "converter/stitch/yarn_relax.h"

#include <doctest/doctest.h>

#include <cmath>

#include "converter/stitch/implicit_surface.h"
#include "converter/stitch/weave.h"
#include "tests/converter/cells.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

/// A plain weave of 2 x 2 yarns, 1 mm apart.
StitchPattern woven(double radius) {
  Yarn yarn;
  yarn.radius_mm = radius;
  return draw_weave({{yarn, yarn}, {yarn, yarn}, {1, 1}, {1, 1}, {true, false, false, true}}, "woven");
}

}  // namespace

TEST_CASE("yarns with too little room end as thick as there is room for") {
  // Parallel straight yarns 1 mm apart, in a plane that they cannot leave.
  StitchPattern pattern{"parallel", {4, 2}, {}};
  for (const double y : {0.5, 1.5})
    pattern.yarns.push_back({"y", 0.6, {0, 0, 0}, {line({0, y, 0}, {4, y, 0})}});
  const RelaxResult relaxed = relax(pattern);
  CHECK(relaxed.radius_fraction * 0.6 == doctest::Approx(0.5).epsilon(0.02));
  CHECK(relaxed.pattern.yarns[0].radius_mm == doctest::Approx(relaxed.radius_fraction * 0.6));
  CHECK(relaxed.radius_fraction < 1);
}

TEST_CASE("crossing yarns touch where they cross, and keep over what was over") {
  const StitchPattern relaxed = relax(woven(0.25)).pattern;
  CHECK(std::abs(*minimum_clearance(relaxed, "")) < 0.02 * 0.25);
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < 2; ++j) {
      for (const Crossing& c : crossings_of(relaxed, relaxed.yarns[i], relaxed.yarns[2 + j])) {
        // Level where they cross, so one radius of each apart.
        CHECK(std::abs(c.z_a - c.z_b) == doctest::Approx(0.5).epsilon(0.03));
        CHECK((c.z_a > c.z_b) == (i == j));
      }
    }
  }
}

TEST_CASE("a gap keeps yarns apart") {
  RelaxOptions options;
  options.gap_radii = 0.4;
  const StitchPattern relaxed = relax(woven(0.2), options).pattern;
  CHECK(*minimum_clearance(relaxed, "") == doctest::Approx(0.4 * 0.2).epsilon(0.05));
}

TEST_CASE("between two plates cloth is as thick as they are apart") {
  RelaxOptions options;
  options.max_thickness_radii = 4.5;
  const RelaxResult relaxed = relax(woven(0.45), options);
  CHECK(relaxed.radius_fraction < 1);
  const double radius = relaxed.pattern.yarns[0].radius_mm;
  for (const Yarn& yarn : relaxed.pattern.yarns)
    for (const BezierSegment& segment : yarn.segments)
      CHECK(std::abs(segment[0].z) <= (2.25 - 1) * radius * 1.001);
}
