#include "converter/stitch/pattern.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "converter/stitch/clearance.h"
#include "converter/stitch/library.h"
#include "converter/stitch/pattern_json.h"
#include "converter/stitch/weave.h"
#include "converter/stitch/yarn_relax.h"
#include "format/base/random.h"
#include "tests/converter/cells.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

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

const std::string good = R"({
  "selvedge_stitch": 1,
  "name": "one",
  "period_mm": [4, 4],
  "yarns": [
    {"radius_mm": 0.5, "albedo": [0.1, 0.2, 0.3],
     "segments": [[[0, 2, 0], [1, 2, 0], [3, 2, 0], [4, 2, 0]]]}
  ]
})";

std::string with(const std::string& from, const std::string& to) {
  std::string text = good;
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

/// The refusal of a text: its code's name and place.
std::string refusal(const std::string& text) {
  const auto pattern = read_stitch(text, "t.json");
  if (pattern) return "accepted";
  CHECK(pattern.error().file == "t.json");
  CHECK(to_line(pattern.error()).find('\n') == std::string::npos);
  return std::string(name_of(pattern.error().code)) + " " + pattern.error().place;
}

/// A plain weave of 2 x 2 yarns, 1 mm apart.
StitchPattern woven(double radius) {
  Yarn yarn;
  yarn.radius_mm = radius;
  return draw_weave({{yarn, yarn}, {yarn, yarn}, {1, 1}, {1, 1}, {true, false, false, true}}, "woven");
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

TEST_CASE("several repeats of a stitch are the same cloth, of yarns as long") {
  for (const char* name : {"rib", "satin"}) {
    const StitchPattern one = test::need(find_stitch(name, of_tubes())).pattern;
    for (const int count : {2, 3}) {
      CAPTURE(name);
      CAPTURE(count);
      const StitchPattern many = repeat_pattern(one, count);
      CHECK(validate(many, name).has_value());
      CHECK(many.period_mm == one.period_mm * count);
      std::size_t segments = 0;
      for (const Yarn& yarn : one.yarns) segments += yarn.segments.size();
      std::size_t of_many = 0;
      for (const Yarn& yarn : many.yarns) of_many += yarn.segments.size();
      CHECK(of_many == segments * count * count);
      Random random(1);
      for (int i = 0; i < 500; ++i) {
        const V3d at(random.uniform() * many.period_mm.x, random.uniform() * many.period_mm.y,
                     2 * random.uniform() - 1);
        CHECK(distance_to_yarns(many, at) == doctest::Approx(distance_to_yarns(one, at)).epsilon(1e-9));
      }
    }
  }
}

TEST_CASE("a pattern written and read again is the same to the bit") {
  StitchPattern odd = cylinder(4, 1.0 / 3);
  odd.name = "quoted \" and \xC3\xBC";
  odd.yarns[0].segments[0][1] = {4.0 / 3, 2 + 1e-16, -0.1 / 3};
  odd.yarns[0].albedo = {1.0F / 3, 0.1F, 1e-20F};
  odd.yarns[0].gloss = {0.1F, 1.0F / 3};
  odd.yarns[0].plies = 3;
  odd.yarns[0].twist_per_mm = -1.0 / 7;
  odd.seed = 4294967295;
  odd.yarns[0].fibre_kind = 3;
  odd.yarns[0].fibre_degrees = 100.0 / 7;
  odd.yarns[0].hairiness = 1.0 / 3;
  odd.yarns[0].hair_mm = 0.1;
  odd.yarns[0].hair_loops = 0.7;
  odd.yarns[0].irregularity = 0.01;
  odd.yarns[0].transmission = 1.0 / 3;
  odd.yarns[0].flattening = 2.0 / 3;
  for (const StitchPattern& pattern : {plain_knit(), plain_weave(), odd})
    CHECK(test::need(read_stitch(to_json(pattern), "again")) == pattern);
}

TEST_CASE("a yarn may have a colour, a fibre and an angle of twist") {
  const auto yarn_with = [](const std::string& members) {
    return test::need(read_stitch(with(R"("albedo": [0.1, 0.2, 0.3])", members), "t.json")).yarns[0];
  };
  const Yarn wool = yarn_with(R"("colour": "#ff0000", "fibre": "wool", "twist_degrees": -45)");
  CHECK(wool.albedo == V3f(1, 0, 0));
  CHECK(wool.gloss.weight > 0.09F);
  CHECK(wool.gloss.roughness == 0.35F);
  CHECK(wool.twist_per_mm == doctest::Approx(-1 / (2 * std::acos(-1.0) * 0.5)));
  CHECK(wool.plies == 1);  // the fibre says nothing of how it is spun
  CHECK(yarn_with(R"("albedo": [0, 0, 0], "fibre": "silk", "gloss": 0)").gloss.weight == 0);
  const auto refused = [](const std::string& members) {
    return refusal(with(R"("albedo": [0.1, 0.2, 0.3])", R"("albedo": [0, 0, 0], )" + members));
  };
  CHECK(refused(R"("fibre": "steel")") == "STITCH_INVALID /yarns/0/fibre");
  CHECK(refused(R"("twist_degrees": 90)") == "STITCH_INVALID /yarns/0/twist_degrees");
  CHECK(refused(R"("fibre_degrees": 61)") == "STITCH_INVALID /yarns/0/fibre_degrees");
  CHECK(refused(R"("plies": 0)") == "STITCH_INVALID /yarns/0/plies");
  CHECK(refused(R"("hairiness": 5)") == "STITCH_INVALID /yarns/0/hair_mm");
  CHECK(refused(R"("hairiness": 5, "hair_mm": 1.4)") == "STITCH_INVALID /yarns/0/hair_mm");
  CHECK(refused(R"("hairiness": 5, "hair_mm": 1.3)") == "accepted");
  CHECK(refused(R"("irregularity": -0.1)") == "STITCH_INVALID /yarns/0/irregularity");
  CHECK(refused(R"("transmission": 1.1)") == "STITCH_INVALID /yarns/0/transmission");
  CHECK(refusal(with(R"("albedo": [0.1, 0.2, 0.3])", R"("colour": "red")")) ==
        "STITCH_INVALID /yarns/0/colour");
  CHECK(refusal(with(R"("name": "one",)", R"("name": "one", "seed": 1.5,)")) == "STITCH_INVALID /seed");
}

TEST_CASE("wrong types and missing members are refused with their JSON pointer") {
  for (const char* foreign : {"[]", "{}", R"({"width": 2, "grid": [0, 1]})"})
    CHECK(refusal(foreign) == "STITCH_INVALID /selvedge_stitch");
  const std::vector<std::array<std::string, 3>> rows{
      {"stitch\": 1", "stitch\": 2", "selvedge_stitch"},
      {"stitch\": 1", "stitch\": 1.5", "selvedge_stitch"},
      {"\"one\"", "1", "name"},
      {"[4, 4]", "[4]", "period_mm"},
      {"[4, 4]", "[4, \"4\"]", "period_mm/1"},
      {"radius_mm", "radius", "yarns/0/radius_mm"},
      {"0.5", "null", "yarns/0/radius_mm"},
      {"0.2, 0.3]", "0.2]", "yarns/0/albedo"},
      {"[3, 2, 0], ", "", "yarns/0/segments/0"},
      {"[3, 2, 0]", "[3, true, 0]", "yarns/0/segments/0/2/1"},
      {"\"radius_mm\"", "\"name\": 1, \"radius_mm\"", "yarns/0/name"}};
  for (const auto& [from, to, place] : rows) CHECK(refusal(with(from, to)) == "STITCH_INVALID /" + place);
}

TEST_CASE("deep nesting is refused, not followed, and so is a text beyond the limit") {
  CHECK(refusal(std::string(1000000, '[')).starts_with("JSON_MALFORMED"));
  CHECK(refusal(std::string(max_stitch_bytes + 1, ' ')).starts_with("FILE_TOO_LARGE"));
}

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
