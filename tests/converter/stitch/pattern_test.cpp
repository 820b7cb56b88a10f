#include "converter/stitch/pattern.h"

#include <doctest/doctest.h>

#include <limits>

#include "tests/converter/cells.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

/// "place [message]" of the refusal, empty if it was accepted.
std::string refusal(const StitchPattern& pattern, const StitchLimits& limits = {}) {
  const auto sound = validate(pattern, "file", limits);
  if (sound) return "";
  CHECK(sound.error().code == Code::stitch_invalid);
  CHECK(sound.error().file == "file");
  CHECK_FALSE(sound.error().message.empty());
  return sound.error().place;
}

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

TEST_CASE("accepts a yarn that runs on and a ring") {
  CHECK(refusal(cylinder(4, 0.5)).empty());
  CHECK(refusal(ring(4, 1, 0.3)).empty());
  CHECK(turns_of(cylinder(4, 0.5).yarns[0], V2d(4, 4)) == V2i(1, 0));
  CHECK(turns_of(ring(4, 1, 0.3).yarns[0], V2d(4, 4)) == V2i(0, 0));
}

TEST_CASE("refuses a pattern without yarn") {
  StitchPattern pattern = cylinder(4, 0.5);
  pattern.yarns.clear();
  CHECK(refusal(pattern) == "/yarns");
}

TEST_CASE("refuses a yarn without segments") {
  StitchPattern pattern = cylinder(4, 0.5);
  pattern.yarns[0].segments.clear();
  CHECK(refusal(pattern) == "/yarns/0/segments");
}

TEST_CASE("refuses periods and radii that are not positive, or of no cloth") {
  for (const double bad : {0.0, -1.0, 1e-30, 1e30, not_a_number, infinity}) {
    StitchPattern pattern = cylinder(4, 0.5);
    pattern.period_mm.y = bad;
    CHECK(refusal(pattern) == "/period_mm/1");
    pattern = cylinder(4, 0.5);
    pattern.yarns[0].radius_mm = bad;
    CHECK(refusal(pattern) == "/yarns/0/radius_mm");
  }
}

TEST_CASE("refuses an albedo outside of 0 to 1") {
  for (const float bad : {-0.1F, 1.1F, std::numeric_limits<float>::quiet_NaN()}) {
    StitchPattern pattern = cylinder(4, 0.5);
    pattern.yarns[0].albedo.y = bad;
    CHECK(refusal(pattern) == "/yarns/0/albedo/1");
  }
}

TEST_CASE("refuses control points that are not finite or far away") {
  for (const double bad : {not_a_number, infinity, -infinity, 1e6}) {
    StitchPattern pattern = cylinder(4, 0.5);
    pattern.yarns[0].segments[0][2].z = bad;
    CHECK(refusal(pattern) == "/yarns/0/segments/0/2");
  }
}

TEST_CASE("refuses a chain with a gap, and one that does not repeat") {
  StitchPattern pattern = ring(4, 1, 0.3);
  pattern.yarns[0].segments[5][0].z += 0.01;
  CHECK(refusal(pattern) == "/yarns/0/segments/5");
  pattern = cylinder(4, 0.5);
  pattern.yarns[0].segments[0][3].x = 3.9;
  CHECK(refusal(pattern) == "/yarns/0/segments/0");
  pattern = cylinder(4, 0.5);
  pattern.yarns[0].segments[0][3].z = 0.1;  // whole periods lie in the plane
  CHECK(refusal(pattern) == "/yarns/0/segments/0");
}

TEST_CASE("lets the rounding of written decimals pass as joined") {
  StitchPattern pattern = ring(4, 1, 0.3);
  pattern.yarns[0].segments[5][0].z += 0.9 * chain_tolerance * 0.3;
  CHECK(refusal(pattern).empty());
}

TEST_CASE("refuses what is beyond the stated limits") {
  CHECK(refusal(ring(4, 1, 0.3, 32), {31, 2, 64}) == "/yarns/0/segments");
  StitchPattern pattern = cylinder(4, 8.1);
  CHECK(refusal(pattern) == "/yarns/0/radius_mm");
}
