#include "converter/stitch/clearance.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

#include "converter/stitch/library.h"
#include "format/base/random.h"
#include "tests/converter/cells.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

TEST_CASE("refuses yarns too long for their radius") {
  StitchPattern pattern = cylinder(4, 1e-7);
  CHECK(test::error_of(minimum_clearance(pattern, "long")).code == Code::mesh_invalid);
}

TEST_CASE("refuses to compare thousands of yarns in one place") {
  const auto many = [](double radius) {
    StitchPattern pattern = cylinder(4, radius);
    pattern.yarns.resize(3000, pattern.yarns.front());
    return pattern;
  };
  CHECK(test::need(minimum_clearance(many(7), "many")) == -14);
  // A thick yarn far above them: all thin ones are near enough to be looked at.
  StitchPattern thin = many(0.01);
  thin.yarns.resize(300);
  thin.yarns.push_back(many(7).yarns.front());
  for (BezierSegment& segment : thin.yarns.back().segments)
    for (V3d& p : segment) p.z += 30;
  CHECK(test::error_of(minimum_clearance(thin, "many")).code == Code::mesh_invalid);
}

TEST_CASE("the clearance of parallel yarns is their spacing less their radii") {
  StitchPattern pattern = cylinder(4, 0.9);
  CHECK(*minimum_clearance(pattern, "") == 0.9);  // copies are 2.2 apart: beyond what is looked at
  pattern.yarns.push_back({"second", 0.4, {0, 0, 0}, {line({0, 3.5, 0.3}, {4, 3.5, 0.3})}});
  const double distance = std::hypot(1.5, 0.3);
  CHECK(*minimum_clearance(pattern, "") == doctest::Approx(distance - 1.3).epsilon(1e-12));
  pattern.yarns[1].radius_mm = 0.8;
  CHECK(*minimum_clearance(pattern, "") == doctest::Approx(distance - 1.7).epsilon(1e-12));
}

TEST_CASE("a yarn is not in its own way, but its other turns are") {
  CHECK(*minimum_clearance(cylinder(1, 0.45), "") == doctest::Approx(0.1).epsilon(1e-12));
  // Points nearer along a ring than pi radii do not count: the chord at that arc. Where the count begins is
  // known to a step of 1/16 radius, and the chord grows by 0.43 of that (the cosine of half the arc's angle).
  const double chord = 2 * 0.7 * std::sin(std::numbers::pi * 0.5 / (2 * 0.7));
  CHECK(std::abs(*minimum_clearance(ring(4, 0.7, 0.5), "") - (chord - 1)) < 0.43 * 0.5 / 16);
  // The next course of a slanted yarn is a copy of the same chain, further along.
  StitchPattern slanted{"slanted", {4, 1}, {}};
  slanted.yarns.push_back({"y", 0.4, {0, 0, 0}, {line({0, 0, 0}, {4, 1, 0})}});
  CHECK(*minimum_clearance(slanted, "") == doctest::Approx(4 / std::sqrt(17.0) - 0.8).epsilon(1e-9));
}
