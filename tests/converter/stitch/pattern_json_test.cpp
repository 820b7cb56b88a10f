#include "converter/stitch/pattern_json.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>

#include "converter/stitch/library.h"
#include "tests/converter/cells.h"
#include "tests/converter/load_cell.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

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

}  // namespace

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
