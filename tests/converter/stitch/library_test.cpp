#include "converter/stitch/library.h"
#include "converter/stitch/yarn_relax.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "converter/stitch/clearance.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/find_cell.h"
#include "converter/stitch/parameters.h"
#include "converter/stitch/pattern_json.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/atomic_file.h"
#include "format/base/memory.h"
#include "tests/converter/cells.h"
#include "tests/converter/load_cell.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;
using namespace selvedge::testing;

namespace {

StitchPattern found(const std::string& name, const StitchSettings& settings = {}) {
  return test::need(find_stitch(name, of_tubes(settings))).pattern;
}

double min_radius(const StitchPattern& pattern) {
  double least = pattern.yarns[0].radius_mm;
  for (const Yarn& yarn : pattern.yarns) least = std::min(least, yarn.radius_mm);
  return least;
}

/// Rows of the drawdown from the bottom, '#' where the warp is over. Warp yarns come first.
std::vector<std::string> drawdown_of(const StitchPattern& pattern, std::size_t warps) {
  std::vector<std::string> rows;
  for (std::size_t j = warps; j < pattern.yarns.size(); ++j) {
    std::string row;
    for (std::size_t i = 0; i < warps; ++i) {
      int crossings = 0;
      bool over = false;
      for (const Crossing& c : crossings_of(pattern, pattern.yarns[i], pattern.yarns[j])) {
        ++crossings;
        over = c.z_a > c.z_b;
      }
      CHECK(crossings == 1);
      row += over ? '#' : '-';
    }
    rows.push_back(row);
  }
  return rows;
}

/// Valid, of smooth chains, and its neighbours touch.
void check_stitch(const StitchInfo& info, const FoundStitch& stitch) {
  CAPTURE(info.name);
  const StitchPattern& pattern = stitch.pattern;
  CHECK(pattern.name == info.name);
  CHECK(validate(pattern, info.name));
  CHECK_FALSE(info.description.empty());
  CHECK(info.description.find('\n') == std::string::npos);
  // Gap and overlap of neighbouring yarns are at most 2 % of the radius.
  const auto clearance = test::need(minimum_clearance(pattern, ""));
  const double fraction = clearance / min_radius(pattern);
  MESSAGE(info.name, ": clearance ", clearance, " mm, ", 100 * fraction, " % of the radius");
  CHECK(fraction < touching_overlap);
  CHECK(fraction > -touching_overlap);
  // Each segment leaves in the direction in which the one before arrived.
  for (const Yarn& yarn : pattern.yarns) {
    for (std::size_t s = 0; s < yarn.segments.size(); ++s) {
      const V3d arrival = derivative_at(yarn.segments[s], 1).normalized();
      const BezierSegment& next = yarn.segments[(s + 1) % yarn.segments.size()];
      CHECK((arrival - derivative_at(next, 0).normalized()).length() < 1e-9);
    }
  }
}

}  // namespace

// In one test: to make all stitches is what takes long.
TEST_CASE(
    "every built-in stitch is found by its name and valid, its chains are smooth, its neighbours touch") {
  for (const StitchInfo& info : built_in_stitches())
    check_stitch(info, test::need(find_stitch(info.name, of_tubes({}))));
  CHECK(plain_knit().yarns[0].segments == found("plain-knit").yarns[0].segments);
}

TEST_CASE("one entry adds a stitch") {
  const StitchEntry moss{"moss", "moss stitch", 0, "yarn A: albedo=0.1,0.2,0.3\n2: k p\n1: p k"};
  const StitchEntry rep{
      "rep", "warp rep", 0, "", {{"#-", "#-", "-#", "-#"}, "wool", {1, 0.3, {}}, {1, 0.3, {}}}};
  for (const StitchEntry& entry : {moss, rep}) {
    const FoundStitch stitch = test::need(find_stitch(entry, of_tubes({})));
    check_stitch({entry.name, entry.description, {}}, stitch);
    const auto& yarn = test::need(find_stitch(entry)).pattern.yarns[0];
    CHECK(yarn.fibre_kind == find_yarn_kind("wool"));
  }
  // Lists of stitches follow the entries.
  const auto infos = built_in_stitches();
  const auto entries = built_in_entries();
  REQUIRE(infos.size() == entries.size());
  std::string names;
  for (std::size_t i = 0; i < infos.size(); ++i) {
    CHECK(infos[i].name == entries[i].name);
    CHECK(infos[i].cover_fraction == entries[i].cover_fraction);
    CHECK(test::need(describe_stitch(entries[i].name)).description == entries[i].description);
    names += (i == 0 ? "" : ", ") + entries[i].name;
  }
  CHECK(to_line(test::error_of(find_stitch("cable"))) ==
        "cable: no such file and no such built-in stitch (there are " + names + ") [STITCH_UNKNOWN]");
}

TEST_CASE("slack is the gap between neighbouring yarns, and makes them longer") {
  for (const char* name : {"plain-knit", "twill"}) {
    CAPTURE(name);
    const std::string radius = name == std::string("twill") ? "warp_radius_mm" : "radius_mm";
    StitchSettings thin{{radius, {0.25}}, {"weft_radius_mm", {0.25}}};
    if (radius == "radius_mm") thin = {{radius, {0.4}}};
    const StitchPattern tight = found(name, thin);
    thin["slack"] = {0.3};
    const StitchPattern loose = found(name, thin);
    const double r = tight.yarns[0].radius_mm;
    CHECK(std::abs(*minimum_clearance(loose, "") - 0.3 * r) < 0.03 * r);
    CHECK(std::abs(*minimum_clearance(tight, "")) < 0.02 * r);
  }
}

TEST_CASE("weaves go over and under as their names say") {
  const std::vector<std::pair<std::string, std::vector<std::string>>> weaves{
      {"plain-weave", {"#-", "-#"}},
      {"twill", {"##--", "-##-", "--##", "#--#"}},
      {"herringbone", {"##--##--", "-##-#--#", "--##--##", "#--#-##-"}},
      {"denim", {"-###", "#-##", "##-#", "###-"}},
      {"satin", {"#-###", "###-#", "-####", "##-##", "####-"}},
      {"basket", {"--##", "--##", "##--", "##--"}}};
  for (const auto& [name, rows] : weaves) {
    const std::string named = name;  // Clang 14 captures no bindings.
    CAPTURE(named);
    CHECK(drawdown_of(found(name), rows.front().size()) == rows);
  }
}

TEST_CASE("parameters move what they name") {
  const StitchPattern knit = found("plain-knit", {{"wale_mm", {2.5}},
                                                  {"course_mm", {1.9}},
                                                  {"albedo", {0.1, 0.2, 0.3}},
                                                  {"plies", {3}},
                                                  {"twist_per_mm", {-0.5}},
                                                  {"gloss", {0.25}},
                                                  {"roughness", {0.4}}});
  CHECK((knit.period_mm - V2d(2.5, 1.9)).length() < 1e-9);
  CHECK(knit.yarns[0].radius_mm == doctest::Approx(0.3));  // follows the gauge
  CHECK(knit.yarns[0].albedo == V3f(0.1F, 0.2F, 0.3F));
  CHECK(knit.yarns[0].plies == 3);
  CHECK(knit.yarns[0].twist_per_mm == -0.5);
  CHECK(knit.yarns[0].gloss == Gloss{0.25F, 0.4F});
  const StitchPattern weave =
      found("twill", {{"warp_spacing_mm", {2}}, {"weft_albedo", {1, 0, 0}}, {"weft_plies", {2}}});
  CHECK(weave.period_mm == V2d(8, 4));
  CHECK(weave.yarns[0].plies == 1);
  CHECK(weave.yarns[4].plies == 2);
  CHECK(weave.yarns[4].albedo == V3f(1, 0, 0));
}

TEST_CASE("yarns that have no room are refused by their parameters") {
  const auto place = [](const char* name, const StitchSettings& settings) {
    const Error error = test::error_of(find_stitch(name, settings));
    CHECK(error.code == Code::option_out_of_range);
    return error.place;
  };
  CHECK(place("plain-knit", {{"radius_mm", {1.5}}}) == "--set radius_mm");
  CHECK(place("basket", {{"warp_radius_mm", {0.6}}}) == "--set warp_radius_mm, weft_radius_mm");
  for (const V2d& size : {V2d(5, 6), V2d(2, 2), V2d(1e6, 3.8)})
    CHECK(place("plain-knit", {{"width_mm", {size.x}}, {"height_mm", {size.y}}}) ==
          "--set width_mm, height_mm");
}

TEST_CASE("a knit is blocked to a size, or one side of it, and its yarn keeps its length") {
  const auto length_of = [](const StitchPattern& pattern) {
    double length = 0;
    for (const BezierSegment& segment : pattern.yarns[0].segments) length += polygon_length(segment);
    return length;
  };
  const StitchPattern free = found("rib");
  const StitchPattern blocked = found("rib", {{"width_mm", {9}}, {"height_mm", {3.4}}});
  CHECK(blocked.period_mm == V2d(9, 3.4));
  CHECK(length_of(blocked) == doctest::Approx(length_of(free)).epsilon(0.01));
  const StitchPattern wide = found("rib", {{"width_mm", {9}}});
  CHECK(wide.period_mm.x == 9);
  CHECK(wide.period_mm.y == doctest::Approx(free.period_mm.y));
}

TEST_CASE(
    "crossed loops lean, in a repeat that is laid upwards until it closes, or straight where that is much") {
  struct Lean {
    const char* chart;
    const char* remark;  // "": none
    V2i cells;           // columns and rows of the pattern
  };
  const char* lies = "wales lean 11 degrees to the left: ";
  const char* stands = "left to itself its wales would lean ";
  for (const Lean& lean :
       {Lean{"1: k tbl", lies, {1, 7}}, Lean{"yarn A:\nyarn B:\n2: k tbl [B]\n1: k tbl [A]", lies, {1, 8}},
        Lean{"1: ktbl8 k", stands, {9, 1}}, Lean{"blocked: yes\n1: k tbl", "", {1, 1}},
        Lean{"1: k", "", {1, 1}}, Lean{"1: k p", "", {2, 1}}, Lean{"1: k tbl p", "", {2, 1}},
        Lean{"4: p2 k4 p2\n3: p2 k4 p2\n2: p2 c4f p2\n1: p2 k4 p2", "", {8, 4}}}) {
    CAPTURE(lean.chart);
    const FoundStitch stitch = test::need(find_stitch(StitchEntry{"lean", "", 0, lean.chart}));
    CHECK(stitch.wales == lean.cells.x);
    CHECK(stitch.stitch_count == lean.cells.x * lean.cells.y);
    const auto told = std::ranges::find_if(
        stitch.remarks, [](const std::string& remark) { return remark.find("lean") != std::string::npos; });
    const std::string remark = told == stitch.remarks.end() ? "" : *told;
    CHECK(remark.substr(0, std::string(lean.remark).size()) == lean.remark);
    CHECK(remark.empty() == std::string(lean.remark).empty());
    const StitchPattern& pattern = stitch.pattern;
    CHECK(pattern.yarns.size() == static_cast<std::size_t>(lean.cells.y));
    CHECK(-test::need(minimum_clearance(pattern, "")) <= touching_overlap * pattern.yarns[0].radius_mm);
    if (lean.remark != lies) continue;
    const V3d step = pattern.yarns[1].segments[0][0] - pattern.yarns[0].segments[0][0];
    CHECK(std::atan2(step.x, step.y) * 180 / std::numbers::pi == doctest::Approx(-11).epsilon(0.1));
    CHECK(step.x * lean.cells.y == doctest::Approx(-pattern.period_mm.x));
    CHECK(step.y * lean.cells.y == doctest::Approx(pattern.period_mm.y));
  }
}

TEST_CASE("yarn of many stitches fits into a file and its readers' memory, with fewer hairs and pieces") {
  const FoundStitch many = test::need(find_stitch("rib-2x2", {{"repeats", {16}}}));
  CHECK(many.remarks.back().ends_with("are kept"));
  const YarnData data = test::need(yarn_curves_of(many.pattern));
  int hairs = 0;
  for (const YarnCurve& curve : data.curves) hairs += curve.hairs.count;
  CHECK(hairs == doctest::Approx(1 << 15).epsilon(0.01));
  CHECK(piece_count(data) <= max_piece_count);
  CHECK(yarn_memory_bytes(data, V2f(many.pattern.period_mm)) < default_memory_limit);
}

TEST_CASE("a stitch description on disk is found by its path and takes the parameters of all yarns") {
  const test::Folder folder;
  const std::string path = folder / "found.json";
  StitchPattern pattern = plain_weave();
  pattern.name = "mine";
  REQUIRE(write_file(path, to_json(pattern)));
  CHECK(test::need(find_stitch(path)).pattern.name == "mine");
  CHECK(test::need(find_stitch(path, {{"yarn", {4}}})).pattern.yarns[0].fibre_kind == 4);
  const auto set = find_stitch(path, {{"slack", {0}}});
  REQUIRE_FALSE(set);
  CHECK(set.error().place == "--set slack");
}

TEST_CASE("a name, a stitch description and a mesh file all give a cell") {
  const test::Folder folder;
  const auto built_in = test::need(load_cell("plain-weave"));
  REQUIRE(write_file(folder / "cell.json", to_json(plain_weave())));
  REQUIRE(write_mesh(folder / "cell.ply", built_in));
  CHECK(test::need(load_cell(folder / "cell.json")).positions == built_in.positions);
  const auto imported = test::need(load_cell(folder / "cell.ply", {.period = V2d(2, 2)}));
  CHECK(imported.positions == built_in.positions);
  CHECK(imported.period == built_in.period);
}

TEST_CASE("a draft is known by its beginning, whatever its name is") {
  const test::Folder folder;
  const std::string draft =
      "[Weaving]\nShafts=2\n[Warp]\nThreads=2\n[Weft]\nThreads=2\n[Threading]\n1=1\n2=2\n[Liftplan]\n1=1\n2="
      "2\n";
  for (const auto& [name, head] : {std::pair("twill.wif.txt", "[WIF]\r\n"),
                                   {"twill.plm", "\n; PixeLoom\n\n[wif]\n"},
                                   {"twill", "[WIF] ; 1.1\n"},
                                   {"twill.WIF", "[CONTENTS]\n[WIF]\n"},
                                   {"twill.json", "\xef\xbb\xbf[WIF]\n"}}) {
    CAPTURE(name);
    REQUIRE(write_file(folder / name, head + draft));
    CellOptions options;
    options.form = StitchForm::yarn;
    CHECK(test::need(find_cell(folder / name, options)).stitch->pattern.yarns.size() == 4);
    CHECK(files_of_cell(folder / name).size() == (std::string(name) == "twill" ? 0 : 1));
  }
}

TEST_CASE("a file of another kind is refused with those that are read") {
  const test::Folder folder;
  REQUIRE(write_file(folder / "machine.k", ";!knitout-2"));
  CHECK(load_cell(folder / "machine.k").error().message ==
        "files that end in \".k\" are not read: .wif are drafts, .txt charts, .json descriptions, .obj and "
        ".ply "
        "meshes");
}

TEST_CASE("settings are read from name=value") {
  StitchSettings settings;
  CHECK(parse_setting("wale_mm=2.5", settings));
  CHECK(parse_setting("albedo=0.1,0.2,0.3", settings));
  CHECK(settings["wale_mm"] == std::vector<double>{2.5});
  CHECK(settings["albedo"] == std::vector<double>{0.1, 0.2, 0.3});
  CHECK(parse_setting("colour=#ff8000", settings));
  CHECK(settings["colour"][0] == 1);
  CHECK(settings["colour"][1] == doctest::Approx(0.21586).epsilon(1e-4));  // sRGB's 128
  CHECK(settings["colour"][2] == 0);
  CHECK(parse_setting("warp_yarn=wool", settings));
  CHECK(settings["warp_yarn"] == std::vector<double>{2});
  for (const char* bad : {"colour=#ff800", "colour=#ff80zz", "colour=#-1-1-1", "yarn=wolo", "yarn=", "", "=",
                          "=1", "wale_mm", "wale_mm=", "wale_mm=x", "wale_mm=1,2,3,4", "wale_mm=nan"}) {
    CAPTURE(bad);
    CHECK_FALSE(parse_setting(bad, settings));
  }
}

TEST_CASE("settings are refused with the name, the range and the names that exist") {
  const std::vector<StitchParameter> parameters{{"a", {1}, 0, 2, ""}, {"b", {1}, 0, 9, "", true}};
  const auto line = [&](const StitchSettings& settings) {
    const auto values = StitchValues::create("s", parameters, settings);
    return values ? "accepted" : to_line(values.error());
  };
  CHECK(line({{"c", {1}}}) == "s: --set c: no such parameter (there are a, b) [OPTION_OUT_OF_RANGE]");
  CHECK(line({{"a", {3}}}) == "s: --set a: must lie in 0 to 2, is 3 [OPTION_OUT_OF_RANGE]");
  CHECK(line({{"a", {1, 1, 1}}}) == "s: --set a: takes 1 numbers, not 3 [OPTION_OUT_OF_RANGE]");
  CHECK(line({{"b", {1.5}}}) == "s: --set b: must be a whole number, is 1.5 [OPTION_OUT_OF_RANGE]");
}

TEST_CASE("a fibre's surface reflects what Fresnel's equations say, and passes light on to the front") {
  // Diffuse light on glass of index 1.5: 0.0918 (Duntley 1942, and tables since).
  CHECK(diffuse_fresnel_reflectance(1.5) == doctest::Approx(0.0918).epsilon(2e-3));
  CHECK(diffuse_fresnel_reflectance(1) == doctest::Approx(0));
  // A weak lens turns light by 2 (n - 1) tan(asin h): within 15 degrees nearly everywhere.
  CHECK(forward_transmitted_fraction(1.01) > 0.99);
  // Glass: asin h - asin(h / 1.5) = 7.5 degrees at h = 0.377, less two reflections of 0.04 each.
  CHECK(forward_transmitted_fraction(1.5) == doctest::Approx(0.377 * 0.96 * 0.96).epsilon(5e-3));
}
