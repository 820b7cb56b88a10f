#include "converter/stitch/chart.h"

#include <doctest/doctest.h>

#include "converter/stitch/chart_stitches.h"
#include "converter/stitch/fibres.h"
#include "converter/stitch/find_cell.h"
#include "converter/stitch/parameters.h"
#include "converter/stitch/text_cells.h"
#include "format/base/atomic_file.h"
#include "format/base/guard.h"
#include "format/picture/image.h"
#include "tests/format/files.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

ChartText chart(const std::string& text) { return test::need(read_chart(text, "chart.txt")); }

std::string refusal(const std::string& text) {
  const Error error = test::error_of(read_chart(text, "chart.txt"));
  CHECK(error.code == Code::stitch_invalid);
  return error.place.empty() ? error.message : error.place + ": " + error.message;
}

/// "k", "p" or "o" with the columns that it is drawn through, where these are not its own: "k-1,0".
std::string text_of(const std::vector<ChartStitch>& row) {
  std::string text;
  for (const ChartStitch& stitch : row) {
    text += text.empty() ? "" : " ";
    text += stitch.source_loops.empty() ? "o" : (stitch.purl ? "p" : "k");
    if (stitch.source_loops.empty() || stitch.source_loops == std::vector{0}) continue;
    for (std::size_t k = 0; k < stitch.source_loops.size(); ++k)
      text += (k > 0 ? "," : "") + std::to_string(stitch.source_loops[k]);
    if (stitch.cable_layer != 0) text += stitch.cable_layer > 0 ? "+" : "-";
  }
  return text;
}

std::string row(const std::string& text) { return text_of(chart("1: " + text).knit.rows[0]); }

}  // namespace

TEST_CASE("a row is read from left to right, with counts behind stitches or after them") {
  CHECK(row("k2 p2") == "k k p p");
  CHECK(row("k 2, p") == "k k p");
  CHECK(row("k p k 3 p1") == "k p k k k p");
  CHECK(row("K2, P YO K2TOG") == "k k p o k-1,0");
  // Letters of yarns keep their case where both are there.
  const ChartText named = chart("NAME: Rope\nYarn A: albedo=#ffffff\nyarn a:\nyarn B:\n1: K3 [a A b]");
  CHECK(named.name == "Rope");
  const auto& stitches = named.knit.rows[0];
  CHECK(std::vector{stitches[0].yarn, stitches[1].yarn, stitches[2].yarn} ==
        std::vector<std::size_t>{1, 0, 2});
}

TEST_CASE("the loop in front of a decrease is the left one of k2tog and the right one of ssk") {
  // Knitters: k2tog leans to the right, ssk to the left. The other loop stays in its column.
  CHECK(row("k yo k2tog k") == "k o k-1,0 k");
  CHECK(row("k ssk yo k") == "k k1,0 o k");
  // Around the edge of the repeat.
  CHECK(row("k2tog k2 yo") == "k-1,0 k k o");
  CHECK(row("yo k2 ssk") == "o k k k1,0");
}

TEST_CASE("a cable's front stitches go to the left with f and to the right with b") {
  // C4F: the first two stitches of the row, which are the right ones, wait in front and are knitted last.
  CHECK(text_of(chart("3: K6\n2: K C4F K\n1: K6").knit.rows[1]) == "k k2+ k2+ k-2- k-2- k");
  CHECK(text_of(chart("3: k6\n2: k c4b k\n1: k6").knit.rows[1]) == "k k2- k2- k-2+ k-2+ k");
  CHECK(text_of(chart("2: c2f 2 p\n1: k5").knit.rows[1]) == "k1+ k-1- k1+ k-1- p");
}

TEST_CASE("rows may be written from the bottom or from the top") {
  for (const char* text : {"1: k p\n2: p k\n3: k2", "3: k2\n2: p k\n1: k p"}) {
    const auto rows = chart(text).knit.rows;
    CHECK(text_of(rows[0]) + ", " + text_of(rows[1]) + ", " + text_of(rows[2]) == "k p, p k, k k");
  }
}

TEST_CASE("a row is knitted with the yarns of its letters, else with the first") {
  const ChartText text = chart(
      "\xef\xbb\xbfname: mine\r\n# a comment\r\nwale_mm: 2.5\r\ncourse_mm: 1.9\r\nyarn x: albedo=#ff0000 "
      "radius_mm=0.25\r\nyarn b: albedo=0.25,0.5,1 yarn=silk plies=2\r\n\r\n"
      "1: k4\r\n2: k4 [b]\r\n3: k4 [x b2 x]\r\n");
  CHECK(text.name == "mine");
  CHECK(text.knit.wale_mm == 2.5);
  CHECK(text.knit.course_mm == 1.9);
  REQUIRE(text.knit.yarns.size() == 2);
  CHECK(text.knit.yarns[0].albedo == V3f(1, 0, 0));
  CHECK(text.knit.yarns[0].radius_mm == 0.25);
  CHECK(text.knit.yarns[0].fibre_kind == find_yarn_kind("wool"));
  CHECK(text.knit.yarns[1].albedo == V3f(0.25F, 0.5F, 1));
  CHECK(text.knit.yarns[1].radius_mm == doctest::Approx(0.355));  // as 0.71 to 5 mm and 3.8 mm
  CHECK(text.knit.yarns[1].fibre_kind == find_yarn_kind("silk"));
  CHECK(text.settings[1] == StitchSettings{{"plies", {2}}});
  std::string yarns;
  for (const auto& stitches : text.knit.rows)
    for (const ChartStitch& stitch : stitches) yarns += std::to_string(stitch.yarn);
  CHECK(yarns == "000011110110");
}

TEST_CASE("floats behind more than five stitches are remarked on, around the edge of the repeat as well") {
  CHECK(chart("yarn A:\nyarn B:\n1: k6 [B A5]").remarks.empty());
  const auto remarks = chart("yarn A:\nyarn B:\n1: k8 [A]\n2: k8 [A3 B2 A3]\n").remarks;
  REQUIRE(remarks.size() == 1);
  CHECK(remarks[0] == "yarn B floats behind 6 stitches of row 2: knitters catch what is longer than 5");
}

TEST_CASE("a chart is cut to its smallest repeat in both directions") {
  struct Case {
    const char* text;
    std::size_t width, height;
    const char* remark;
  };
  const Case cases[] = {
      // NOLINT(modernize-avoid-c-arrays)
      {"1: k4 p2 k4 p2", 6, 1, "12 x 1 stitches, smallest repeat 6 x 1"},
      {"1: k p\n2: p k\n3: k p\n4: p k", 2, 2, "2 x 4 stitches, smallest repeat 2 x 2"},
      {"1: c4f c4f\n2: k8\n3: k8\n4: c4f c4f\n5: k8\n6: k8", 4, 3, "8 x 6 stitches, smallest repeat 4 x 3"},
      {"yarn A:\nyarn B:\n1: k4 [A B A A]\n2: k4", 4, 2, ""},
      {"yarn A:\nyarn B:\n1: k4 [A B A B]\n2: k4", 2, 2, "4 x 2 stitches, smallest repeat 2 x 2"},
      {"1: k p k p k", 5, 1, ""},  // no whole number of k p
      {"1: k yo k2tog k", 4, 1, ""}};
  for (const auto& [text, width, height, remark] : cases) {
    CAPTURE(text);
    const ChartText cut = chart(text);
    CHECK(cut.knit.rows.size() == height);
    CHECK(cut.knit.rows.front().size() == width);
    CHECK((cut.remarks.empty() ? "" : cut.remarks.front()) == remark);
  }
}

TEST_CASE("what a chart says wrong is refused with its line") {
  CHECK(refusal("") == "has no row");
  CHECK(refusal("name: a\nk2 p2") ==
        "line 2: is neither of the form \"name: rope\" nor a row such as \"1: k2 p2\"");
  CHECK(refusal("gauge: 3\n1: k") ==
        "line 1: \"gauge\" must be name, wale_mm, course_mm, blocked (yes or no), float, \"yarn A\" or the "
        "number "
        "of a row");
  CHECK(refusal("1: k\nname: a") == "line 2: \"name\" must come before the rows");
  CHECK(refusal("name: a\nname: b\n1: k") == "line 2: \"name\" is said a second time");
  CHECK(refusal("wale_mm: 0\n1: k") == "line 1: wale_mm must be a number from 0.001 to 1000, is \"0\"");
  CHECK(refusal("course_mm: wide\n1: k") ==
        "line 1: course_mm must be a number from 0.001 to 1000, is \"wide\"");
  CHECK(refusal("1: k\n\n2: k caf\xe9") == "line 3: has a byte that is not UTF-8");
}

TEST_CASE("rows that say their side are read as knitters work them") {
  const ChartText worked =
      chart("yarn A:\nyarn B:\nRow 1 (RS): k3 p [A3 B]\nrow 2 (ws): k p3 [B2 A2]\nROW 3: p k3 [B A3]\n");
  for (const auto& stitches : worked.knit.rows) {
    CHECK(text_of(stitches) == "p k k k");
    CHECK((stitches[0].yarn == 1 && stitches[3].yarn == 0));
  }
  CHECK(worked.remarks.size() == 1);
  CHECK(row("k yo k2tog k") == text_of(chart("row 1(rs): k k2tog yo k").knit.rows[0]));
  CHECK(text_of(chart("2 (WS): k p3\n1: k4").knit.rows[1]) == "p k k k");
}

TEST_CASE("rows and yarns that do not fit are refused with their line and word") {
  const std::string fit = ": all rows must fit one number";
  const std::string unknown = " (there are k, p, k tbl";
  const std::string counts =
      "as many yarn overs as decreases keep their number, and shaped pieces are not drawn";
  const std::string one = "cut the chart to one repeat, or to a part";
  std::string many;
  for (const char letter : std::string("ABCDEFGHI")) many += std::string("yarn ") + letter + ":\n";
  const std::pair<std::string, std::string> cases[] = {
      // NOLINT(modernize-avoid-c-arrays)
      {"1: k2\n2: k2 m\n", "line 2: there is no stitch \"m\"" + unknown},
      {"1: k c5f", "line 1: there is no stitch \"c5f\"" + unknown},
      {"1: k c10f", "line 1: there is no stitch \"c10f\"" + unknown},
      {"1: k c0b", "line 1: there is no stitch \"c0b\"" + unknown},
      {"1: k c4", "line 1: there is no stitch \"c4\"" + unknown},
      {"1: k2\n2: k3", "line 2: row 2 takes 3 stitches, row 1 takes 2 stitches" + fit},
      {"1: k\n3: k", "line 2: row 2 is missing below row 3"},
      {"1: k\n1: k", "line 2: row 1 is given a second time"},
      {"0: k",
       "line 1: \"0\" must be name, wale_mm, course_mm, blocked (yes or no), float, \"yarn A\" or the number "
       "of a "
       "row"},
      {"1:", "line 1: the row has no stitch"},
      {"1: 4 k", "line 1: \"4\" counts nothing"},
      {std::string("wale_mm: 5\0x\n1: k", 17), "line 1: has a NUL byte"},
      {"1: k 99999999999", "line 1: \"k 99999999999\" has no count from 1 to 1048576"},
      {"1: (k999) 1200 times", "line 1: more than 1048576 stitches in all rows: " + one},
      {"1: k900000\n2: k900000", "line 2: more than 1048576 stitches in all rows: " + one},
      {"1: k yo k", "line 1: row 1 takes 2 stitches and makes 3: " + counts},
      {"1: k6\n2: c6f\n",
       "line 2: stitches that move aside take 1.58 rows of the chart, there is room for 1.20"},
      {"yarn AB: yarn=wool\n1: k", "line 1: a yarn is called by one letter, as \"yarn A\""},
      {"yarn A:\nyarn B: radius_mm=11\n1: k",
       "line 2: radius_mm: 11 is more than 2 times the shorter side 3.8 mm"},
      {"yarn A:\nyarn A:\n1: k", "line 2: \"yarn A\" is said a second time"},
      {"yarn A: red\n1: k", "line 1: \"red\" is not of the form albedo=#aa3322"},
      {"yarn A: yarn=hemp\n1: k", "line 1: \"yarn=hemp\" is not of the form"},
      {"yarn A: plies=2 plies=3\n1: k", "line 1: \"plies=3\" sets a parameter a second time"},
      {"yarn A: radius_mm=0\n1: k", "line 1: radius_mm: must lie in 0.001 to 1000, is 0"},
      {"yarn A: wale_mm=5\n1: k", "line 1: wale_mm: no such parameter"},
      {"1: k [B]", "line 1: there is no yarn B (there are A)"},
      {"1: k3 [A2]", "line 1: names yarns for 2 stitches, the row has 3"},
      {"1: k2 [A ?]", "line 1: there is no stitch \"A\"" + unknown},
      {"1: k [A", "line 1: there is no stitch \"A\"" + unknown},
      {"1: k A]", "line 1: there is no stitch \"A\"" + unknown},
      {"1: k ]A[", "line 1: \"]\" closes no bracket"},
      {"1: [A] k", "line 1: there is no stitch \"A\"" + unknown},
      {many + "1: k", "line 9: there are more than 8 yarns"},
      {many.substr(0, 40) + "1: k5 [A B C D E]",
       "line 6: the row has 5 yarns, at most 4 can float behind it"},
      // Written instructions.
      {"Row 1: k2, kfb", "line 1: there is no stitch \"kfb\"" + unknown},
      {"Row 1: k2\nRow 2: Bind off all sts", "line 2: \"Bind\" is of a shaped piece: keep the rows"},
      {"Row 1: k2\nDec 1 st at each end of next row.", "line 2: \"Dec\" is of a shaped piece"},
      {"Row 1: (k1, p1, k1) in next st", "line 1: \"in\" follows several stitches of one"},
      {"Row 1: k1, ssk, k to last 3 sts, k2tog, k1", "line 1: row 1 takes 6 stitches and makes 4: " + counts},
      {"Row 1: *k2, p1; rep from *\nRow 2: *k2, yo; rep from *",
       "line 2: row 2, in its repeat, takes 2 stitches and makes 3: " + counts},
      {"Row 1: *k2, p2; rep from * to last st, k1\nRow 2: *k2, p2; rep from * to last 3 sts, k3",
       "line 2: row 2 takes a multiple of 4 stitches plus 3, row 1 takes a multiple of 4 stitches plus 1" +
           fit},
      {"Row 1: *k2; rep from * to last 2 sts, k1",
       "line 1: row 1 repeats to the last 2 stitches, and takes 1"},
      {"Row 1: *k2; rep from *, *p2; rep from *", "line 1: row 1 repeats two groups"},
      {"Row 1: k2\nRow 2: as row 3", "line 2: row 2 repeats row 3, which is not above it"},
      {"Row 1: work sts as they appear", "line 1: row 1 shows what no row below it has"},
      {"Row 1: k1, psso", "line 1: \"psso\" passes no slipped stitch over"},
      {"Row 1: K1b", "line 1: \"K1b\" is \"k tbl\" (p tbl) in some patterns, \"tuck\""},
      {"Row 1: (k-b, p1)", "line 1: \"k-b\" is \"k tbl\""},
      {"Row 1: sl 3 to cn, hold in front, p1, p3 from cn", "line 1: \"cn\" crosses no cable that is drawn: "},
      {"Row 1: k\nRow 2: continue in pattern", "line 2: \"continue\" does not say which rows: \"Rows 5-8: "},
      {"Row 1: (k2, p2", "line 1: a bracket is not closed"},
      {"Row 1: K2000000", "line 1: \"K2000000\" has no count from 1 to 1048576"},
      {std::string("Row 1: ") + std::string(99, '('), "line 1: \"(\" is in too many brackets"}};
  for (const auto& [text, why] : cases) {
    CAPTURE(text);
    CHECK(refusal(text).substr(0, why.size()) == why);
  }
}

TEST_CASE("a chart on disk is a stitch with the parameters of a knit and of each of its yarns") {
  const test::Folder folder;
  const std::string path = folder / "stripe.txt";
  REQUIRE(write_file(path,
                     "yarn A: albedo=#ffffff radius_mm=0.4\n"
                     "yarn B: albedo=#ff0000 radius_mm=0.5 yarn=tube plies=2\n1: k [A]\n2: k [B]\n"));
  CHECK(files_of_cell(path) == std::vector<std::string>{path});
  const FoundStitch found = test::need(find_stitch(path));
  CHECK(found.pattern.name == "stripe");
  CHECK(found.plain_mm == V2d(5, 3.8));
  // The size is told before the yarns are laid, and may be refused.
  StitchSize told;
  const Error refused = test::error_of(find_stitch(path, {{"repeats", {2}}}, [&](const StitchSize& size) {
    told = size;
    throw Failure{{Code::option_out_of_range, path, "--texels", "too few"}};
  }));
  CHECK(refused.message == "too few");
  CHECK(told.min_texels == found.min_texels * 2);
  CHECK(told.crossing_count == found.stitch_count * 4);
  CHECK_FALSE(told.is_woven);
  CHECK(found.min_texels == V2i(2, 4));
  REQUIRE(found.pattern.yarns.size() == 2);
  CHECK(found.pattern.yarns[0].fibre_kind == find_yarn_kind("wool"));
  CHECK(found.pattern.yarns[0].plies == 3);
  CHECK(found.pattern.yarns[1].fibre_kind == 0);
  CHECK(found.pattern.yarns[1].plies == 2);
  const StitchPattern set = test::need(find_stitch(path, {{"yarn", {2}},
                                                          {"second_plies", {4}},
                                                          {"second_albedo", {0, 1, 0}},
                                                          {"wale_mm", {2.5}},
                                                          {"course_mm", {1.9}}}))
                                .pattern;
  for (const Yarn& yarn : set.yarns) CHECK(yarn.fibre_kind == 2);
  CHECK(set.yarns[0].radius_mm == doctest::Approx(0.2));
  CHECK(set.yarns[1].radius_mm == doctest::Approx(0.25));
  CHECK(set.yarns[1].plies == 4);
  CHECK(set.yarns[1].albedo == V3f(0, 1, 0));
  const Error thick = test::error_of(find_stitch(path, {{"radius_mm", {0.8}}}));
  CHECK(thick.file == path);
  CHECK(thick.place == "--set radius_mm");
}

TEST_CASE("written instructions are read as they are worked, and their repeat is taken") {
  struct Case {
    const char* text;
    const char* rows;  ///< from the bottom
  };
  const Case cases[] = {
      // NOLINT(modernize-avoid-c-arrays)
      {"Row 1 (RS): Knit.\nRow 2: Purl.", "k"},
      {"Row 1: Knit all sts\nRow 2: K", "k | p"},
      {"Rnd 1: *K1, p1; rep from * around\nRound 2: Purl", "p k | p p"},
      // Garter rib: the wrong side is read from the back, edge stitches are left out.
      {"Row 1 (RS): K1, *p2, k2; rep from * to last 3 sts, p2, k1\nRow 2: P1, *k2, p2; rep from * to last 3 "
       "sts,\nk2, p1",
       "k p p k"},
      {"1st row: K2. *P2. K2. Rep from * to end of row.\n2nd row: P2. *K2. P2. Rep from * to end of row.",
       "p p k k"},
      // Books of a hundred years ago.
      {"1st row.\xe2\x80\x94K 1, * p 2, k 2; rep. from * to last 3, p 2, k 1.\n2nd row.\xe2\x80\x94P 1, * k "
       "2, p 2; "
       "rep. from * to last 3, k 2, p 1.",
       "k p p k"},
      {"Rows 1 & 3: K\nRow 2 and all even rows: *k1, p1; rep from * to end\nRep rows 1\xe2\x80\x93"
       "4.",
       "k k | p k"},
      {"Every row: k1, *p1, k1; rep from *\nRep row 1 for pattern.", "p k | k p"},
      // Seed stitch of one row: sides alternate.
      {"Row 1: *K1, p1; rep from * to last st, k1.\nRepeat row 1.", "p k | k p"},
      {"Row 1: [k1, p1] 2x\nRow 2: K the purls and p the knits", "p k | k p"},
      {"Row 1 (WS): K 2, P 2\nRow 2: k the knits and p the purls", "p p k k"},
      // A decrease that is purled from the back is knit on the face.
      {"Row 1: knit\nRow 2: P1, yo, p2tog, p1", "k k k k | k o k-1,0 k"},
      {"Row 1 (RS): *K2 tog, yo; rep from * to end\nRow 2 and all WS rows: P\nRow 3: knit",
       "o k-1,0 | k k | k k | k k"},
      {"Rnd 1: *sl 1, k2tog, psso, yo twice*\nRnd 2: k", "o o k1,-1,0 | k k k"},
      {"Row 1: sl2 tog knitwise, k1, p2sso, yo, k1, yo\nRow 2: purl", "o k o k0,1,-1 | k k k k"},
      {"Rnd 1: 2/1 RPC, p1\nRnd 2-4: k", "p p2- k-1+ k-1+ | k k k k | k k k k | k k k k"},
      {"Rnd 1: *T3F, P1; rep from *\nRnds 2-4: k", "p k1+ k1+ p-2- | k k k k | k k k k | k k k k"},
      // Cables that are spelled out.
      {"Rnd 1: Sl 1 to cn, hold in front, k1, k1 from cn\nRnd 2: knit", "k1+ k-1- | k k"},
      {"Rnd 1: *slip next 2 sts onto cable needle and hold at back of work, k2, then p2 from cable needle; "
       "rep "
       "from *\nRnds 2-4: k",
       "p2- p2- k-2+ k-2+ | k k k k | k k k k | k k k k"},
      {"Row 1 (RS): k, p\nRows 2-3: Work in St st\nRow 4: continue in reverse stockinette stitch.",
       "p k | k k | k k | p p"},
      {"All WS rows: purl\nRow 1: k\nRows 3 and 4: in garter st", "k | k | k | p"},
      {"Row 1: *K1, p1; repeat between *s to end\nRow 2: **P1, k1; rep from ** to end", "p k | k p"},
      // Cables that go around the edge of the repeat.
      {"Rnd 1: *c4f*\nRnd 2 and 3: K\nRnd 4: k2, *c4f; rep from * to last 2 sts, k2\nRnds 5-6: rep rnds 2-3",
       "k2+ k2+ k-2- k-2- | k k k k | k k k k | k-2- k-2- k2+ k2+ | k k k k | k k k k"}};
  for (const auto& [text, rows] : cases) {
    CAPTURE(text);
    std::string read;
    for (const auto& stitches : chart(text).knit.rows)
      read += (read.empty() ? "" : " | ") + text_of(stitches);
    CHECK(read == rows);
  }
  const ChartText yarns =
      chart("Row 1: With MC, k1, sl 1 wyif\nRow 2: With CC, purl\nRow 3: With CC, rep row 1");
  CHECK(yarns.knit.yarns.size() == 2);
  CHECK((yarns.knit.rows[0][0].yarn == 0 && yarns.knit.rows[1][0].yarn == 1 &&
         yarns.knit.rows[2][0].yarn == 1));
}

TEST_CASE("a picture is a chart: a pixel is a stitch, a colour a yarn, from the most frequent on") {
  const auto picture = [](int width, int height, int colours, float opacity = 1) {
    Image image{width, height, 4, {}};
    for (int k = 0; k < width * height; ++k) {
      const bool light = k < colours;
      for (const float value :
           {light ? static_cast<float>(k % 256) / 255 : 1.0F, light ? 0.0F : 1.0F, 1.0F, opacity})
        image.pixels.push_back(value);
    }
    const auto bytes = test::need(encode_png(image, Transfer::keep));
    return catch_failure(
        [&] { return chart_of_picture(std::string(bytes.begin(), bytes.end()), "heart.png"); });
  };
  CHECK(test::need(picture(3, 2, 1)) ==
        "float: 7\nyarn A: albedo=#ffffff\nyarn B: albedo=#0000ff\n2: k3 [B1 A2]\n1: k3 [A3]\n");
  CHECK(test::error_of(picture(20, 20, 200)).message.starts_with("201 colours, at most 6 can be yarns"));
  CHECK(test::error_of(picture(1100, 20, 1))
            .message.starts_with("1100 x 20 pixels, a chart has at most 1024 x 1024"));
  CHECK(test::error_of(picture(2, 2, 1, 0.5F)).message.starts_with("4 pixels are not opaque"));
}
