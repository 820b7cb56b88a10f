#include "converter/stitch/wif.h"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <sstream>

#include "converter/stitch/clearance.h"
#include "converter/stitch/flat_yarn.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"
#include "converter/stitch/yarn_relax.h"
#include "format/base/atomic_file.h"
#include "tests/converter/cells.h"
#include "tests/converter/load_cell.h"
#include "tests/format/files.h"
#include "tests/require.h"
#include "tests/shared_data.h"

using namespace selvedge;

namespace {

/// A 2/2 twill of 8 x 8 yarns by four treadles.
const std::string good = R"([WIF]
Version=1.1
[WEAVING]
Shafts=4
Treadles=4
Rising Shed=yes
[WARP]
Threads=8
Units=Centimeters
Spacing=0.1
Thickness=0.06
Color=1
[WEFT]
Threads=8
Units=Centimeters
Spacing=0.2
Thickness=0.06
Color=2
[COLOR PALETTE]
Range=0,255
[COLOR TABLE]
1=255,0,0
2=0,0,255
[THREADING]
1=1
2=2
3=3
4=4
5=1
6=2
7=3
8=4
[TIEUP]
1=1,2
2=2,3
3=3,4
4=1,4
[TREADLING]
1=1
2=2
3=3
4=4
5=1
6=2
7=3
8=4
)";

std::string with(const std::string& from, const std::string& to, std::string text = good) {
  const std::size_t at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

WifDraft draft(const std::string& text) {
  const auto read = read_wif(text, "d.wif");
  INFO((read ? std::string("read") : to_line(read.error())));
  REQUIRE(read);
  return *read;
}

/// Rows from the bottom, '#' where the warp is over.
std::string drawdown(const Weave& weave) {
  std::string text;
  for (std::size_t j = 0; j < weave.weft.size(); ++j) {
    for (std::size_t i = 0; i < weave.warp.size(); ++i) text += weave.is_warp_over(i, j) ? '#' : '-';
    text += ' ';
  }
  return text;
}

std::string refusal(const std::string& text) {
  const auto read = read_wif(text, "d.wif");
  if (read) return "accepted";
  CHECK(read.error().file == "d.wif");
  CHECK(read.error().code == Code::stitch_invalid);
  return read.error().place + ": " + read.error().message;
}

/// A draft of warps x wefts yarns with one shaft and one lift of its own for each, by a rule.
template <class Over>
std::string draft_of(int warps, int wefts, const Over& over) {
  std::ostringstream out;
  out << "[WIF]\n[WEAVING]\nShafts=" << warps << "\n[WARP]\nThreads=" << warps
      << "\nSpacing=0.1\n[WEFT]\nThreads=" << wefts << "\nSpacing=0.1\n[THREADING]\n";
  for (int i = 1; i <= warps; ++i) out << i << "=" << i << "\n";
  out << "[LIFTPLAN]\n";
  for (int j = 1; j <= wefts; ++j) {
    out << j << "=0";
    for (int i = 1; i <= warps; ++i)
      if (over(i, j)) out << "," << i;
    out << "\n";
  }
  return out.str();
}

}  // namespace

TEST_CASE("a draft's threading, tie-up and treadling make its drawdown, reduced to the smallest repeat") {
  const WifDraft twill = draft(good);
  CHECK(twill.warp_threads == 8);
  CHECK(twill.weft_threads == 8);
  CHECK(drawdown(twill.weave) == "##-- -##- --## #--# ");
  CHECK(twill.remarks == std::vector<std::string>{"8 x 8 yarns, smallest repeat 4 x 4"});
}

TEST_CASE("spacing, thickness and colours come with their units and ranges") {
  const Weave weave = draft(good).weave;
  CHECK(weave.warp_spacing_mm[0] == doctest::Approx(1));
  CHECK(weave.weft_spacing_mm[3] == doctest::Approx(2));
  CHECK(weave.warp[0].radius_mm == doctest::Approx(0.3));
  CHECK(weave.warp[0].albedo == V3f(1, 0, 0));
  CHECK(weave.weft[0].albedo == V3f(0, 0, 1));
  const Weave inches = draft(with("Units=Centimeters\nSpacing=0.1", "Units=Inches \nSpacing=0.1")).weave;
  CHECK(inches.warp_spacing_mm[0] == doctest::Approx(2.54));
  const Weave points = draft(with("Units=Centimeters\nSpacing=0.1", "Units=Decipoints\nSpacing=72")).weave;
  CHECK(points.warp_spacing_mm[0] == doctest::Approx(2.54));
  const auto wide = draft(with("Units=Centimeters\nSpacing=0.1", "Units=Inches\nSpacing=20")).remarks;
  CHECK(
      std::ranges::any_of(wide, [](const auto& line) { return line.starts_with("warp spacing of 508 mm"); }));
  const Weave hsb =
      draft(with("1=255,0,0", "1=85,128,255", with("Range=0,255", "Range=0,255\nForm=hsb"))).weave;
  CHECK((hsb.warp[0].albedo - V3f(0.2122308F, 1, 0.2122308F)).length() < 1e-5F);  // 127 of 255
  const std::string percent = with("1=255,0,0", "1=120,50,100", with("2=0,0,255", "2=240,100,100"));
  for (const char* range : {"Range=0,360\nForm=HSB", "Range=0,100\nForm=HSV", "Form=HSB"}) {
    const WifDraft read = draft(with("Range=0,255", range, percent));
    CHECK((read.weave.warp[0].albedo - V3f(0.2140411F, 1, 0.2140411F)).length() < 1e-5F);
    CHECK((read.weave.weft[0].albedo - V3f(0, 0, 1)).length() < 1e-5F);
    CHECK(std::ranges::count(read.remarks,
                             "[COLOR TABLE] of HSB: hues read in degrees, the rest in percent") == 1);
  }
  // 128 of 255, and 128 of -128 to 255, through the sRGB curve.
  const std::string grey = with("1=255,0,0", "1=128,128,128");
  CHECK(draft(grey).weave.warp[0].albedo.x == doctest::Approx(0.2158605));
  CHECK(draft(with("Range=0,255", "Range=-127,383", grey)).weave.warp[0].albedo.x ==
        doctest::Approx(0.2140411));
}

TEST_CASE("colours, spacing and thickness of single yarns take precedence over the section's") {
  const std::string text =
      good + "[WARP COLORS]\n2=2\n6=2\n[WEFT SPACING]\n1=0.3\n5=0.3\n[WARP THICKNESS]\n3=0.04\n7=0.04\n";
  const Weave weave = draft(text).weave;
  CHECK(weave.warp.size() == 4);
  CHECK(weave.warp[0].albedo == V3f(1, 0, 0));
  CHECK(weave.warp[1].albedo == V3f(0, 0, 1));
  CHECK(weave.weft_spacing_mm[0] == doctest::Approx(3));
  CHECK(weave.weft_spacing_mm[1] == doctest::Approx(2));
  CHECK(weave.warp[2].radius_mm == doctest::Approx(0.2));
  // A repeat is one of colours, spacing and thickness as well.
  CHECK(draft(good + "[WARP COLORS]\n2=2\n").weave.warp.size() == 8);
}

TEST_CASE("sheds, liftplans, several shafts and treadles, and incomplete repeats make a drawdown") {
  const std::string lifts = with("[TIEUP]", "[LIFTPLAN]\n1=1\n2=2\n3=3\n4=4\n5=1\n6=2\n7=3\n8=4\n[TIEUP]");
  // Warp 1 also on shaft 3; weft 1 by two treadles.
  const std::string several = with("\n1=1\n2=2\n3=3\n4=4\n5=1", "\n1=1,3\n2=2\n3=\n4=0\n5=1");
  // Beyond the header's counts.
  const std::string five = with("1=1,2\n2=2,3", "1=1,2,5\n2=2,3\n5=5", with("4=4\n5=1", "4=4,5\n5=1"));
  const std::string nine = with("8=4\n[TIEUP]", "8=4\n9=1\n[TIEUP]", with("Threads=8", "Threads=9"));
  for (const auto& [text, rows] :
       {std::pair(with("Rising Shed=yes", "Rising Shed=0"), "--## #--# ##-- -##- "),
        {lifts, "#--- -#-- --#- ---# "},
        {with("[WIF]", "[CONTENTS]\nLIFTPLAN=false\n[WIF]", lifts), "##-- -##- --## #--# "},
        {with("[TREADLING]\n1=1", "[TREADLING]\n1=1, 3", several), "##--#### ##---##-"},
        {with("[TREADLING]\n1=1", "[TREADLING]\n1=5", five), "---#----"},
        {nine, "##-- -##- --## #--# "}})
    CHECK(drawdown(draft(text).weave).starts_with(rows));
  CHECK(draft(nine).remarks[0] ==
        "9 x 8 yarns, smallest repeat 4 x 4, the incomplete repeat at the end left out");
}

TEST_CASE("empty yarns at the end of a canvas are left out, and that is said") {
  const WifDraft read =
      draft(with("[WEFT]\nThreads=8", "[WEFT]\nThreads=1000", with("Threads=8", "Threads=2000")));
  CHECK(drawdown(read.weave) == drawdown(draft(good).weave));
  CHECK(read.remarks[0] == "8 x 8 yarns, smallest repeat 4 x 4");
  const auto said = [&](const char* remark) {
    return std::count(read.remarks.begin(), read.remarks.end(), remark);
  };
  CHECK(said("the last 1992 of 2000 warp yarns are not woven: left out") == 1);
  CHECK(said("the last 992 of 1000 weft yarns are not woven: left out") == 1);
  // One empty yarn, or as many as are empty elsewhere, belong to the weave.
  CHECK(draft(with("8=4\n[TIEUP]", "[TIEUP]")).warp_threads == 8);
  CHECK(draft(with("\n2=2\n3=3\n4=4\n5=1\n6=2\n7=3\n8=4", "\n4=4\n5=1\n6=2")).warp_threads == 8);
}

TEST_CASE("what programs write is read: names in any case, comments, blanks, line ends, byte order marks") {
  const std::string twill = drawdown(draft(good).weave);
  std::string lower = good;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  CHECK(drawdown(draft(lower).weave) == twill);
  for (const std::string end : {"\r\n", "\r"}) {
    std::string text;
    for (const char c : good) text += c == '\n' ? end : std::string(1, c);
    CHECK(drawdown(draft(text).weave) == twill);
  }
  CHECK(drawdown(draft("\xef\xbb\xbf; a comment\n\n" + good + "[PRIVATE X]\nname=Gr\xfcn\n").weave) == twill);
  CHECK(drawdown(draft(with("Shafts=4", "  Shafts  =  4  ")).weave) == twill);
  CHECK(drawdown(draft(good + "\n9=0\n").weave) == twill);  // a zero behind the last one
}

TEST_CASE("drafts of real programs are read, with a remark on what was left out or mended") {
  const auto without = [](const std::string& from, const std::string& to) {
    const std::size_t begin = good.find(from);
    return std::string(good).erase(begin, good.find(to) - begin);
  };
  const std::string lifts = "[LIFTPLAN]\n1=1,2\n2=2,3\n3=3,4\n4=1,4\n5=1,2\n6=2,3\n7=3,4\n8=1,4\n";
  const std::string no_table = "no [COLOR TABLE]: off-white warp and blue weft";
  const std::string unknown_colour = "colours that are not in [COLOR TABLE]: as yarns without a colour";
  const std::string comment = "comments behind numbers left out";
  const std::string text = "lines of text in other sections left out";
  const std::string nothing = "[LIFTPLAN] lifts nothing: [TIEUP] and [TREADLING] are read";
  const auto denies = [](const char* name) {
    return fmt::format("[CONTENTS] denies [{}], which is there", name);
  };
  const std::vector<std::pair<std::string, std::string>> cases{
      {with("[TIEUP]", "[LIFTPLAN]\n[TIEUP]"), nothing},
      {good + "[LIFTPLAN]\n1=0\n2=\n8=0\n", nothing},
      {with("Spacing=0.1", "Spacing=0.1 ;10 ends a cm"), comment},
      {with("1=255,0,0", "1=255,0,0\t;red=warm"), comment},
      {with("\n2=2,3", "\n2=2,3;a twill", with("Rising Shed=yes", "Rising Shed=yes ; a jack loom")), comment},
      {with("[WEAVING]", "[PRIVATE X NOTES]\nfree text; of the program\n[half a bracket\n[WEAVING]"), text},
      {good + "[NOTES]\nwarp it wide\n" + std::string(70000, 'x') + "\n[PRIVATE X]\n[12] ends\n", text},
      {with("[WARP]", "[NOTES]\n[WARP] of wool\n[WARP] ;\n"), text},
      {without("[TIEUP]", "[nothing]") + "[TIEUP]\n[TREADLING]\n" + lifts + "[CONTENTS]\nLIFTPLAN=0\n",
       denies("LIFTPLAN")},
      {without("[COLOR PALETTE]", "[THREADING]"), no_table},
      {with("1=255,0,0\n2=0,0,255\n", ""), no_table},
      {with("1=255,0,0\n2=0,0,255\n", "", with("Color=1", "Color=9,0,128,0")), no_table},
      {with("Color=1", "Color=3"), unknown_colour},
      {with("Color=1", "Color=") + "[WARP COLORS]\n5=7\n1=7\n", unknown_colour},
      {with("1=255,0,0\n2=0,0,255\n", "1=999,0,0\n2=0,0,321\n", without("[COLOR PALETTE]", "[COLOR TABLE]")),
       "[COLOR PALETTE] without a range: 0 to 999"},
      {with("Range=0,255", "Range=0,255\nForm=Decimal"),
       "[COLOR PALETTE] of another form: read as red, green, blue"},
      {with("[WIF]", "[CONTENTS]\nTHREADING=no ;\n[WIF]"), denies("THREADING")},
      {with("[WIF]", "[CONTENTS]\nCOLOR TABLE=0\n[WIF]"), denies("COLOR TABLE")},
      {without("[TIEUP]", "[nothing]") + lifts + "[CONTENTS]\nLIFTPLAN=off\n", denies("LIFTPLAN")},
      {with("[WIF]", "[CONTENTS]\nLIFTPLAN=no\n[WIF]") + "[LIFTPLAN]\n1=4\n", denies("LIFTPLAN")},
      {good + "[TIEUP]\n1=4\n", "[TIEUP] is there 2 times: number 1 is read"},
      {with("[WARP]", "[NOTES]\n1=The order is\n[THREADING]\n2=as always\n[WARP]\n"),
       "[THREADING] is there 2 times: number 2 is read"},
      {with("[WARP]", "[NOTES]\nsee\n[Tieup]\nand\n[WARP]\nbelow\n[WEFT]\n[WARP]\n"),
       "[WARP] is there 2 times: number 2 is read"},
      {with("1=255,0,0", "1=0,255,255",
            with("2=0,0,255", "2=170,255,255", with("Range=0,255", "Range=0,255\nForm=HSB"))),
       ""},
      {with("Spacing=0.1", "Spacing=0,1"), "commas in lengths read as decimal points"},
      {with("Shafts=4\nTreadles=4\n", "") + "\x1a\x00\x00", ""}};
  for (const auto& [file, remark] : cases) {
    CAPTURE(file);
    const WifDraft read = draft(file);
    CHECK(drawdown(read.weave) == drawdown(draft(good).weave));
    CHECK(read.weave.warp_spacing_mm[0] == doctest::Approx(1));
    CHECK((remark.empty() || std::ranges::count(read.remarks, remark) == 1));
  }
  CHECK(draft(cases[11].first).weave.warp[0].albedo.y == doctest::Approx(0.2158605));
}

TEST_CASE("broken drafts are refused by section and key") {
  CHECK(refusal("") == ": has no section: not a WIF file");
  CHECK(refusal("v 1 2 3\n") == "line 1: is before the first section: not a WIF file");
  CHECK(refusal("[WARP]\nnonsense\n") == "line 2: is neither a section nor of the form key=value");
  CHECK(refusal("[WARP\n") == "line 1: a section's name has no closing bracket");
  CHECK(refusal(with("[WIF]", "[OTHER]")) == "[WIF]: the section is missing: not a WIF file");
  CHECK(refusal(with("[WARP]", "[X]")) == "[WARP]: the section is missing");
  CHECK(refusal(with("[TREADLING]", "[X]")) == "[TREADLING]: the section is missing, and [LIFTPLAN] as well");
  CHECK(refusal(with("Threads=8\n", "")) == "[WARP] THREADS: is missing");
  CHECK(refusal(with("Threads=8", "Threads=0")) == "[WARP] THREADS: must lie in 1 to 16384, is 0");
  CHECK(refusal(with("Threads=8", "Threads=eight")) == "[WARP] THREADS: \"eight\" is not a whole number");
  CHECK(refusal(with("8=4\n[TIEUP]", "8=5\n[TIEUP]")) == "[THREADING] 8: must lie in 0 to 4, is 5");
  CHECK(refusal(with("4=1,4", "4=1,,4")) == "[TIEUP] 4: \"\" is not a whole number");
  CHECK(refusal(with("Rising Shed=yes", "Rising Shed=maybe")) ==
        "[WEAVING] RISING SHED: \"maybe\" is neither true nor false");
  CHECK(refusal(with("Units=Centimeters", "Units=Furlongs")) ==
        "[WARP] UNITS: \"furlongs\" must be Decipoints, Inches or Centimeters");
  CHECK(refusal(with("Spacing=0.1", "Spacing=-1")) == "[WARP] SPACING: \"-1\" is not a number of at least 0");
  CHECK(refusal(good + "[WEFT THICKNESS]\n2=0.00005\n") ==
        "[WEFT THICKNESS] 2: must lie in 0.001 to 1000 mm, is 0.0005");
  CHECK(refusal("[WARP]\n1=" + std::string(70000, '1')) == "line 2: has more than 65536 bytes");
  CHECK(refusal(with("1=1,2\n", "1=1 2\n")) == "[TIEUP] 1: \"1 2\" is not a whole number");
  const std::string loose = ": every warp yarn stays on one side of all weft yarns: they are not woven";
  CHECK(refusal(with("[TREADLING]\n", "[TREADLING]\n[X]\n")) == loose);
  CHECK(refusal(with("[TIEUP]", "[LIFTPLAN]\n[X]", with("[TREADLING]", "[Y]"))) == loose);
  CHECK(refusal(with("1=255,0,0", "1=255,0")) == "[COLOR TABLE] 1: \"255,0\" is not red, green, blue");
  CHECK(refusal(with("Range=0,255", "Range=5,5")) == "[COLOR PALETTE] RANGE: \"5,5\" holds no values");
  CHECK(refusal(good + "[WEFT COLORS]\n12=1\n") == "[WEFT COLORS] 12: must lie in 1 to 8, is 12");
}

/// Why a draft is read and not made.
std::string refused(const std::string& text) {
  const test::Folder folder;
  test::write_bytes(folder / "d.wif", text);
  const Error error = test::error_of(find_stitch(folder / "d.wif"));
  CHECK(error.code == Code::stitch_invalid);
  return error.place + ": " + error.message;
}

TEST_CASE("a draft that would take too long to relax is refused before") {
  const std::string too_long =
      ": the yarns are too long for their thickness: to relax them would take too long";
  CHECK(refused(with("Thickness=0.06", "Thickness=0.0001")) == too_long);
  // Thin weft beside thick warp, which is the neighbour of all of it.
  CHECK(refused(with("Spacing=0.2\nThickness=0.06", "Spacing=0.02\nThickness=0.004",
                     with("Spacing=0.1\nThickness=0.06", "Spacing=0.5\nThickness=0.5"))) == too_long);
  CHECK(refused(with("Spacing=0.2\nThickness=0.06", "Spacing=0.001\nThickness=0.001",
                     with("Spacing=0.1\nThickness=0.06", "Spacing=1\nThickness=1")))
            .starts_with("/yarns/0/radius_mm: radius "));
}

bool irregular(int i, int j) { return (i * i + 3 * j * j + i * j) % 7 < 3 || i == j; }

TEST_CASE("a repeat that is too large is refused") {
  CHECK(refused(draft_of(150, 120, irregular)) ==
        ": 18000 stitches, of more than 16384 only knit and purl ones are made: cut the chart to one repeat, "
        "or "
        "to a part");
  CHECK(refusal(draft_of(5000, 5000, [](int, int) { return false; })) ==
        "[WEFT] Threads: 5000 x 5000 yarns are more than 16777216 crossings");
}

TEST_CASE("many yarns nearly touch, keep as many hairs as a file holds, and become a mesh of tubes") {
  const test::Folder folder;
  test::write_bytes(folder / "d.wif", draft_of(50, 48, irregular));
  const FoundStitch found = test::need(find_stitch(folder / "d.wif"));
  CHECK(found.min_texels == V2i(50, 48));
  CHECK(found.remarks.back().ends_with("are kept"));
  const double least = min_half_thickness(found.pattern);
  const double clearance = test::need(minimum_clearance(found.pattern, ""));
  CHECK(std::abs(clearance) < 0.05 * least);
  const CellMesh mesh = test::need(mesh_stitch(found.pattern));
  CHECK(validate(mesh, "d.wif"));
  CHECK(mesh.hairs.root_triangles.size() == doctest::Approx(1 << 16).epsilon(0.01));
  YarnData data = mesh.yarns;
  data.station_light.resize(std::size_t{light_values_per_station} * counts_of(data).stations);
  CHECK(validate(data, V2f(mesh.period)));
  // A decagon has this fraction of its circle.
  double volume = 0;
  for (const Yarn& yarn : found.pattern.yarns) {
    double length = 0;
    for (const BezierSegment& segment : yarn.segments) length += (segment[3] - segment[0]).length();
    volume += 5 * std::sin(std::numbers::pi / 5) * yarn.radius_mm * yarn.radius_mm * length;
  }
  CHECK(testing::volume_of(mesh) == doctest::Approx(volume).epsilon(0.02));
}

TEST_CASE("equal crossings of a large draft rest equal") {
  const test::Folder folder;
  constexpr int count = 21;
  test::write_bytes(folder / "d.wif", draft_of(count, count, irregular));
  const StitchPattern pattern = test::need(find_stitch(folder / "d.wif")).pattern;
  std::map<std::pair<bool, std::vector<bool>>, std::vector<std::pair<int, int>>> equal;
  for (const bool warp : {true, false})
    for (int i = 0; i < count; ++i)
      for (int j = 0; j < count; ++j) {
        std::vector<bool> sides;
        for (int k = 0; k < 9; ++k)
          sides.push_back(
              irregular(1 + (i + k % 3 + count - 1) % count, 1 + (j + k / 3 + count - 1) % count));
        equal[{warp, sides}].emplace_back(warp ? i : count + j, warp ? j : i);
      }
  CHECK(equal.size() < count * count);
  for (const auto& [kind, places] : equal) {
    // Parts begin half-way from the first crossing to the second, and their ends belong to two crossings.
    const auto at = [&](const std::pair<int, int>& place, std::size_t k) {
      const Yarn& yarn = pattern.yarns[place.first];
      const std::size_t each = yarn.segments.size() / count;
      const std::size_t part = (place.second + count - 1) % count;
      return yarn.segments[part * each + k][0] - yarn.segments[part * each + 1][0];
    };
    for (const auto& place : places)
      for (std::size_t k = 2; k < pattern.yarns[0].segments.size() / count; ++k)
        CHECK((at(place, k) - at(places[0], k)).length() < 1e-6 * pattern.yarns[0].radius_mm);
  }
}

TEST_CASE("a draft becomes a weave whose yarns touch, as thick as there is room for") {
  const test::Folder folder;
  test::write_bytes(folder / "twill.wif", with("Thickness=0.06", "Thickness=0.3", good));
  const auto stitch =
      test::need(find_stitch(folder / "twill.wif", of_tubes({{"warp_plies", {2}}, {"weft_gloss", {0.5}}})));
  CHECK(stitch.min_texels == V2i(16, 16));
  CHECK(stitch.pattern.name == "twill");
  CHECK(stitch.pattern.period_mm.y == doctest::Approx(8));
  REQUIRE(stitch.pattern.yarns.size() == 8);
  CHECK(stitch.pattern.yarns[0].plies == 2);
  CHECK(stitch.pattern.yarns[4].gloss.weight == 0.5F);
  CHECK(stitch.pattern.yarns[0].radius_mm < 0.5);
  const double least = std::min(stitch.pattern.yarns[0].radius_mm, stitch.pattern.yarns[4].radius_mm);
  CHECK(std::abs(*minimum_clearance(stitch.pattern, "")) < touching_overlap * least);
  REQUIRE(stitch.remarks.size() == 3);
  // By how much they were thinned: the warp is drawn as thick as its spacing, 1 mm.
  CHECK(stitch.thickness_fraction < 0.995);
  CHECK(stitch.pattern.yarns[0].radius_mm == doctest::Approx(0.5 * stitch.thickness_fraction));
  CHECK(stitch.remarks.back() ==
        fmt::format("yarns thinned to {:.2f} of their thickness: there is no more room",
                    stitch.thickness_fraction));
}

TEST_CASE("the real drafts become weaves") {
  const std::string folder = test::shared_data("yarn/wif");
  if (folder.empty()) return;
  int drafts = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".wif") continue;
    ++drafts;
    const std::string path = entry.path().string();
    const auto text = test::need(read_file(path, max_wif_bytes));
    const auto read = read_wif(text, path);
    CAPTURE(path);
    INFO((read ? std::string("read") : to_line(read.error())));
    REQUIRE(read);
    MESSAGE(entry.path().filename().string(), ": ", read->remarks[0]);
    if (read->weave.warp_is_over.size() > 200) continue;  // takes seconds: those are made by hand
    const auto stitch = test::need(find_stitch(path, of_tubes()));
    double least = 1e9;
    for (const Yarn& yarn : stitch.pattern.yarns) least = std::min(least, yarn.radius_mm);
    CHECK(*minimum_clearance(stitch.pattern, path) > -touching_overlap * least);
  }
  CHECK(drafts == 21);
}
