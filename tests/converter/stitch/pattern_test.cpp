#include "converter/stitch/pattern.h"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/converter/cells.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

/// The place of the refusal, empty if it was accepted.
std::string refusal(const StitchPattern& pattern, const StitchLimits& limits = {}) {
  const auto sound = validate(pattern, "file", limits);
  if (sound) return "";
  CHECK(sound.error().code == Code::stitch_invalid);
  CHECK(sound.error().file == "file");
  CHECK_FALSE(sound.error().message.empty());
  return sound.error().place;
}

}  // namespace

TEST_CASE("a yarn that runs on, a ring, and the rounding of written decimals are accepted") {
  CHECK(refusal(cylinder(4, 0.5)).empty());
  CHECK(chain_periods(cylinder(4, 0.5).yarns[0], V2d(4, 4)) == V2i(1, 0));
  StitchPattern rounded = ring(4, 1, 0.3);
  CHECK(chain_periods(rounded.yarns[0], V2d(4, 4)) == V2i(0, 0));
  rounded.yarns[0].segments[5][0].z += 0.9 * chain_tolerance * 0.3;
  CHECK(refusal(rounded).empty());
}

TEST_CASE("patterns that break a rule are refused with the place of the fault") {
  const std::pair<const char*, std::function<void(StitchPattern&, Yarn&)>> faults[] = {
      {"/yarns", [](StitchPattern& p, Yarn&) { p.yarns.clear(); }},
      {"/yarns/0/segments", [](StitchPattern&, Yarn& y) { y.segments.clear(); }},
      {"/yarns/0/albedo/1", [](StitchPattern&, Yarn& y) { y.albedo.y = 1.1F; }},
      {"/yarns/0/albedo/1", [](StitchPattern&, Yarn& y) { y.albedo.y = -0.1F; }},
      {"/yarns/0/plies", [](StitchPattern&, Yarn& y) { y.plies = 9; }},
      // A gap, an end that is no copy of the start, and one that lies whole periods out of the plane.
      {"/yarns/0/segments/1", [](StitchPattern&, Yarn& y) { y.segments.push_back(y.segments[0]); }},
      {"/yarns/0/segments/0", [](StitchPattern&, Yarn& y) { y.segments[0][3].x = 3.9; }},
      {"/yarns/0/segments/0", [](StitchPattern&, Yarn& y) { y.segments[0][3].z = 4; }},
      {"/yarns/0/radius_mm", [](StitchPattern&, Yarn& y) { y.radius_mm = 8.1; }}};
  for (const auto& [place, make] : faults) {
    StitchPattern pattern = cylinder(4, 0.5);
    make(pattern, pattern.yarns[0]);
    CHECK(refusal(pattern) == place);
  }
  constexpr double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, 1e-30, 1e30, std::numeric_limits<double>::quiet_NaN(), infinity}) {
    StitchPattern pattern = cylinder(4, 0.5);
    pattern.period_mm.y = bad;
    CHECK(refusal(pattern) == "/period_mm/1");
    pattern = cylinder(4, 0.5);
    pattern.yarns[0].radius_mm = bad;
    CHECK(refusal(pattern) == "/yarns/0/radius_mm");
    if (std::abs(bad) < 2) continue;
    pattern = cylinder(4, 0.5);
    pattern.yarns[0].segments[0][2].z = bad;
    CHECK(refusal(pattern) == "/yarns/0/segments/0/2");
  }
  CHECK(refusal(ring(4, 1, 0.3, 32), {31, 2, 64}) == "/yarns/0/segments");
}
