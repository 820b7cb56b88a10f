#include "converter/stitch/chart.h"

#include <doctest/doctest.h>

#include "converter/stitch/fibres.h"
#include "converter/stitch/find_cell.h"
#include "converter/stitch/parameters.h"
#include "format/base/atomic_file.h"
#include "format/base/guard.h"
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
  CHECK(text.knit.yarns[1].radius_mm == doctest::Approx(0.395));  // as 0.6 to 5 mm and 3.8 mm
  CHECK(text.knit.yarns[1].fibre_kind == find_yarn_kind("silk"));
  CHECK(text.settings[1] == StitchSettings{{"plies", {2}}});
  std::string yarns;
  for (const auto& stitches : text.knit.rows) {
    for (const ChartStitch& stitch : stitches) yarns += std::to_string(stitch.yarn);
  }
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

TEST_CASE("rows that say their side are read as knitters work them") {
  const ChartText worked =
      chart("yarn A:\nyarn B:\nRow 1 (RS): k3 p [A3 B]\nrow 2 (ws): k p3 [B2 A2]\nROW 3: p k3 [B A3]\n");
  for (const auto& stitches : worked.knit.rows) {
    CHECK(text_of(stitches) == "p k k k");
    CHECK((stitches[0].yarn == 1 && stitches[3].yarn == 0));
  }
  CHECK(worked.remarks.size() == 1);
  CHECK(row("k yo k2tog k") == text_of(chart("row 1(rs): k k2tog yo k").knit.rows[0]));
  CHECK(refusal("row 1 (ws): k2tog yo").starts_with("line 1: decreases and cables are read as seen from"));
}

TEST_CASE("what a chart says wrong is refused with its line") {
  CHECK(refusal("") == "has no row");
  CHECK(refusal("name: a\nk2 p2") ==
        "line 2: is neither of the form \"name: rope\" nor a row such as \"1: k2 p2\"");
  CHECK(refusal("gauge: 3\n1: k") ==
        "line 1: \"gauge\" must be name, wale_mm, course_mm, \"yarn A\" or the number of a row");
  CHECK(refusal("1: k\nname: a") == "line 2: \"name\" must come before the rows");
  CHECK(refusal("name: a\nname: b\n1: k") == "line 2: \"name\" is said a second time");
  CHECK(refusal("wale_mm: 0\n1: k") == "line 1: wale_mm must be a number from 0.001 to 1000, is \"0\"");
  CHECK(refusal("course_mm: wide\n1: k") ==
        "line 1: course_mm must be a number from 0.001 to 1000, is \"wide\"");
  CHECK(refusal("1: k\n\n2: k caf\xe9") == "line 3: has a byte that is not UTF-8");
}

TEST_CASE("rows that do not fit are refused with their line") {
  CHECK(refusal("1: k2\n2: k2 m\n") ==
        "line 2: there is no stitch \"m\" (there are k, p, yo, k2tog, ssk, and cables of 2 to 8 stitches, "
        "c2f, c2b, c4f, c4b, ...)");
  for (const char* cable : {"c3f", "c10f", "c0b", "c4", "c-2f", "cf", "c99999999999f"})
    CHECK(refusal(std::string("1: ") + cable).starts_with("line 1: there is no stitch \"c"));
  CHECK(refusal("1: k2\n2: k3") == "line 2: row 2 has 3 stitches, row 1 has 2");
  CHECK(refusal("1: k\n3: k") == "line 2: row 3 follows row 1: rows are numbered up or down by one");
  CHECK(refusal("0: k") == "line 1: \"0\" is not the number of a row");
  CHECK(refusal("1:") == "line 1: the row has no stitch");
  CHECK(refusal("1: 4 k") == "line 1: the count 4 follows no stitch");
  CHECK(refusal(std::string("wale_mm: 5\0x\n1: k", 17)) == "line 1: has a NUL byte");
  CHECK(refusal("1: k 99999999999") == "line 1: \"99999999999\" is not a count from 1 to 1024");
  CHECK(refusal("1: k1000 k1000") == "line 1: more than 1024 stitches");
  CHECK(refusal("1: k600\n2: k600") == "line 2: the chart has more than 1024 stitches");
  CHECK(refusal("1: k yo k") ==
        "line 1: yarn overs: 1, decreases: 0; as many of one as of the other keep the number of stitches");
  CHECK(
      refusal("1: k6\n2: c6f\n") ==
      "line 2: stitches that move aside take 1.58 rows of the chart, there is room for 1.20: knit more rows "
      "between them");
}

TEST_CASE("yarns that are not there are refused with their line") {
  CHECK(refusal("yarn AB: yarn=wool\n1: k") == "line 1: a yarn is called by one letter, as \"yarn A\"");
  CHECK(refusal("yarn A:\nyarn B: radius_mm=11\n1: k")
            .starts_with("line 2: radius_mm: 11 is more than 2 times the shorter side 3.8 mm"));
  CHECK(refusal("yarn A:\nyarn A:\n1: k") == "line 2: \"yarn A\" is said a second time");
  CHECK(refusal("yarn A: red\n1: k").starts_with("line 1: \"red\" is not of the form albedo=#aa3322"));
  CHECK(refusal("yarn A: yarn=hemp\n1: k").starts_with("line 1: \"yarn=hemp\" is not of the form"));
  CHECK(refusal("yarn A: plies=2 plies=3\n1: k") == "line 1: \"plies=3\" sets a parameter a second time");
  CHECK(refusal("yarn A: radius_mm=0\n1: k") == "line 1: radius_mm: must lie in 0.001 to 1000, is 0");
  CHECK(refusal("yarn A: wale_mm=5\n1: k").starts_with("line 1: wale_mm: no such parameter"));
  CHECK(refusal("1: k [B]") == "line 1: there is no yarn B (there are A)");
  CHECK(refusal("1: k3 [A2]") == "line 1: names yarns for 2 stitches, the row has 3");
  CHECK(refusal("1: k2 [A ?]") == "line 1: \"?\" is not the letter of a yarn");
  for (const char* brackets : {"1: k [A", "1: k A]", "1: k ]A[", "1: [A] k", "1: k [A] [A]"})
    CHECK(refusal(brackets) ==
          "line 1: the letters of yarns stand in one pair of brackets at the end of the row");
  std::string many;
  for (const char letter : std::string("ABCDEFGHI")) many += std::string("yarn ") + letter + ":\n";
  CHECK(refusal(many + "1: k") == "line 9: there are more than 8 yarns");
  CHECK(refusal(many.substr(0, 40) + "1: k5 [A B C D E]") ==
        "line 6: the row has 5 yarns, at most 4 can float behind it");
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
  CHECK(found.pattern.period_mm == V2d(5, 7.6));
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
  CHECK(found.min_texels == V2i(4, 8));
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
  CHECK(set.period_mm == V2d(2.5, 3.8));
  for (const Yarn& yarn : set.yarns) CHECK(yarn.fibre_kind == 2);
  CHECK(set.yarns[0].radius_mm == doctest::Approx(0.2));
  CHECK(set.yarns[1].radius_mm == doctest::Approx(0.25));
  CHECK(set.yarns[1].plies == 4);
  CHECK(set.yarns[1].albedo == V3f(0, 1, 0));
  const Error thick = test::error_of(find_stitch(path, {{"radius_mm", {0.8}}}));
  CHECK(thick.file == path);
  CHECK(thick.place == "--set radius_mm");
}
