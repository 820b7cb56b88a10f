#include "converter/stitch/knit.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "converter/stitch/chart.h"
#include "converter/stitch/clearance.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_relax.h"
#include "tests/require.h"

using namespace selvedge;

namespace {

/// A loop of a chain: from a foot over its head to the next foot.
struct LoopLine {
  std::size_t column = 0;
  std::vector<V3d> up;    ///< from the left foot to the head
  std::vector<V3d> down;  ///< from the head to the right foot
};

/// The loops of a yarn of a course, in order, from foot to foot by its parts; heads are the middles of their
/// yarn, as the highest place of a loop that lies on its side is a foot.
std::vector<LoopLine> loops_of(const Yarn& yarn, const std::vector<KnitPart>& parts,
                               const std::vector<std::size_t>& columns) {
  std::vector<LoopLine> loops;
  std::size_t segment = 0;
  for (const KnitPart& part : parts) {
    std::vector<V3d> line;
    for (std::size_t s = segment; s < segment + part.segments; ++s)
      for (int k = 0; k < 4; ++k) line.push_back(point_at(yarn.segments[s], 0.25 * k));
    segment += part.segments;
    line.push_back(yarn.segments[segment - 1][3]);
    if (!part.is_loop) continue;
    const auto head = line.begin() + static_cast<long>(line.size() / 2);
    loops.push_back({columns.at(loops.size()), {line.begin(), head + 1}, {head, line.end()}});
  }
  CHECK(loops.size() == columns.size());
  return loops;
}

/// How often the line goes through the triangle towards +normal, less how often it goes back.
int passes(const std::vector<V3d>& line, const V3d& a, const V3d& b, const V3d& c, const V3d& shift) {
  const V3d normal = (b - a).cross(c - a);
  int sum = 0;
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    const V3d p = line[k] + shift;
    const V3d q = line[k + 1] + shift;
    const double from = (p - a).dot(normal);
    const double to = (q - a).dot(normal);
    if ((from < 0) == (to < 0)) continue;
    const V3d x = p + (q - p) * (from / (from - to));
    if ((b - a).cross(x - a).dot(normal) < 0 || (c - b).cross(x - b).dot(normal) < 0 ||
        (a - c).cross(x - c).dot(normal) < 0)
      continue;
    sum += to > 0 ? 1 : -1;
  }
  return sum;
}

/// Through the surface that a loop spans with the line between its feet, from the back to the front.
int passes(const std::vector<V3d>& line, const LoopLine& loop, const V3d& shift) {
  std::vector<V3d> ring = loop.up;
  ring.insert(ring.end(), loop.down.begin() + 1, loop.down.end());
  V3d middle(0);
  for (const V3d& p : ring) middle += p / static_cast<double>(ring.size());
  int sum = 0;
  // From foot to foot over the head is clockwise, seen from the face.
  for (std::size_t k = 0; k < ring.size(); ++k)
    sum -= passes(line, middle, ring[k], ring[(k + 1) % ring.size()], shift);
  return sum;
}

/// Courses that are looked through below a stitch; a column `deeper` counts one more of them.
constexpr int max_down = 3;
constexpr int deeper = 100;

/// Row, column and columns to the right of the loop below that a stitch is drawn through: how often its first
/// half goes through that loop from the back to the front, and its second half back.
using Links = std::map<std::tuple<std::size_t, std::size_t, int>, std::pair<int, int>>;

bool is_loop(const ChartStitch& stitch) {
  return stitch.held == ChartStitch::Held::none || stitch.held == ChartStitch::Held::tuck;
}

/// The loops of every course.
std::vector<std::vector<LoopLine>> courses_of(const KnitChart& chart, const DrawnKnit& knit) {
  std::vector<std::vector<LoopLine>> courses;
  std::size_t chain = 0;
  for (const auto& row : chart.rows) {
    courses.emplace_back();
    std::map<std::size_t, std::vector<std::size_t>> columns;
    for (std::size_t k = 0; k < row.size(); ++k)
      if (is_loop(row[k])) columns[row[k].yarn].push_back(k);
    for (const auto& [yarn, knitted] : columns) {
      const auto loops = loops_of(knit.pattern.yarns[chain], knit.parts[chain], knitted);
      courses.back().insert(courses.back().end(), loops.begin(), loops.end());
      ++chain;
    }
  }
  REQUIRE(chain == knit.pattern.yarns.size());
  return courses;
}

Links links_of(const KnitChart& chart, const DrawnKnit& knit) {
  const StitchPattern& pattern = knit.pattern;
  const auto courses = courses_of(chart, knit);
  const std::size_t columns = chart.rows.front().size();
  const auto count = static_cast<int>(columns);
  Links links;
  for (std::size_t row = 0; row < courses.size(); ++row) {
    for (int down = 1; down <= max_down; ++down) {
      const int lower = static_cast<int>(row) - down;
      const int rows = static_cast<int>(courses.size());
      const int periods = lower >= 0 ? 0 : (rows - 1 - lower) / rows;
      for (const LoopLine& loop : courses[row]) {
        for (const LoopLine& other : courses[lower + periods * rows]) {
          for (int turn = -2; turn <= 2; ++turn) {
            const V3d shift(turn * pattern.period_mm.x, periods * pattern.period_mm.y, 0);
            const std::pair<int, int> found{passes(loop.up, other, shift), passes(loop.down, other, shift)};
            const int away = static_cast<int>(other.column) - static_cast<int>(loop.column) - turn * count +
                             deeper * (down - 1);
            // A yarn over is drawn through nothing: what it passes, its neighbours' legs pass beyond their
            // feet.
            const ChartStitch& stitch = chart.rows[row][loop.column];
            if (!stitch.source_loops.empty() && stitch.held == ChartStitch::Held::none) {
              links[{row, loop.column, away}].first += found.first;
              links[{row, loop.column, away}].second += found.second;
            } else {
              const std::size_t before = (loop.column + columns - 1) % columns;
              const std::size_t after = (loop.column + 1) % columns;
              links[{row, before, away + 1}].second += found.first;
              links[{row, after, away - 1}].first += found.second;
            }
          }
        }
      }
    }
  }
  std::erase_if(links, [](const auto& link) { return link.second == std::pair(0, 0); });
  return links;
}

/// Where the lines of two loops cross in the plane: how often the first lies in front, and behind.
std::pair<int, int> crossings_of(const LoopLine& a, const LoopLine& b) {
  std::pair<int, int> counts{0, 0};
  for (const auto* first : {&a.up, &a.down}) {
    for (const auto* second : {&b.up, &b.down}) {
      for (std::size_t i = 0; i + 1 < first->size(); ++i) {
        for (std::size_t j = 0; j + 1 < second->size(); ++j) {
          const V3d p = (*first)[i];
          const V3d q = (*second)[j];
          const V3d along = (*first)[i + 1] - p;
          const V3d other = (*second)[j + 1] - q;
          const double det = along.x * other.y - along.y * other.x;
          if (det == 0) continue;
          const double s = ((q.x - p.x) * other.y - (q.y - p.y) * other.x) / det;
          const double t = ((q.x - p.x) * along.y - (q.y - p.y) * along.x) / det;
          if (s < 0 || s >= 1 || t < 0 || t >= 1) continue;
          ++(p.z + along.z * s > q.z + other.z * t ? counts.first : counts.second);
        }
      }
    }
  }
  return counts;
}

RelaxResult rested(const KnitChart& chart, const DrawnKnit& knit, Progress progress = {},
                   const RestedKnit* last = nullptr) {
  RelaxOptions options;
  options.progress = std::move(progress);
  options.may_thin = true;
  options.parts = knit.parts;
  options.gauge_mm = {chart.wale_mm, chart.course_mm};
  if (chart.blocked) options.blocked_mm = knit.pattern.period_mm;
  options.last = last;
  return relax(knit.pattern, options);
}

/// The links of the chart.
Links expected(const KnitChart& chart) {
  Links links;
  for (std::size_t row = 0; row < chart.rows.size(); ++row) {
    for (std::size_t k = 0; k < chart.rows[row].size(); ++k) {
      const ChartStitch& stitch = chart.rows[row][k];
      if (stitch.held != ChartStitch::Held::none) continue;
      for (const int through : stitch.source_loops) {
        // Down to the loop that is knitted; a tuck is held with it.
        for (int down = 1, is_held = 1; is_held != 0; ++down) {
          const int count = static_cast<int>(chart.rows.size());
          const auto& below = chart.rows[((static_cast<int>(row) - down) % count + count) % count];
          const auto columns = static_cast<int>(below.size());
          const ChartStitch& loop = below[((static_cast<int>(k) + through) % columns + columns) % columns];
          is_held = loop.held == ChartStitch::Held::none ? 0 : 1;
          const bool turned = stitch.twist != 0 || (loop.source_loops.empty() && loop.twist != 0);
          const int way = stitch.purl != turned ? -1 : 1;
          if (is_loop(loop)) links[{row, k, through + deeper * (down - 1)}] = {way, -way};
        }
      }
    }
  }
  return links;
}

/// The same for the yarn from the middle of one stitch to the middle of the next: where a loop moves away
/// below a knit stitch beside a purl one, their foot goes through it, on either side of the foot's middle.
Links between_stitches(const Links& links, std::size_t columns) {
  Links strands;
  for (const auto& [place, ways] : links) {
    const auto& [row, column, through] = place;
    strands[{row, column, through}].first += ways.first;
    strands[{row, (column + 1) % columns, through - 1}].first += ways.second;
  }
  std::erase_if(strands, [](const auto& strand) { return strand.second.first == 0; });
  return strands;
}

std::string text_of(const Links& links) {
  std::string text;
  for (const auto& [place, ways] : links) {
    const auto& [row, column, through] = place;
    text += std::to_string(row) + "," + std::to_string(column) + " through " + std::to_string(through) +
            ": " + std::to_string(ways.first) + " " + std::to_string(ways.second) + "\n";
  }
  return text;
}

/// How often each loop is passed from either side, by whichever stitch of its row: yarn slides.
std::string passes_of(const Links& links, int columns) {
  std::map<std::tuple<std::size_t, int, bool>, int> counts;
  for (const auto& [place, ways] : links) {
    const auto& [row, column, through] = place;
    const int down = (through + deeper / 2) / deeper;
    const int loop = (static_cast<int>(column) + through - down * deeper + columns) % columns;
    for (const int way : {ways.first, ways.second})
      if (way != 0) counts[{row, loop + down * deeper, way > 0}] += way;
  }
  std::string text;
  for (const auto& [place, count] : counts) {
    const auto& [row, loop, forward] = place;
    text += std::to_string(row) + ", " + std::to_string(loop) + ": " + std::to_string(count) + "\n";
  }
  return text;
}

}  // namespace

TEST_CASE("each loop is drawn through the loops that its chart says and no others, drawn and relaxed") {
  for (const char* text :
       {"1: k p", "2: k3\n1: p3", "4: k2tog k2 yo\n3: k4\n2: k yo k2tog k\n1: k4", "2: k4\n1: k ssk yo k",
        // Cables to both sides, of all widths, between purls and beside each other.
        "3: p k2 p\n2: p c2f p\n1: p k2 p", "3: p k2 p\n2: p c2b p\n1: p k2 p",
        "4: p k4 p\n3: p k4 p\n2: p c4f p\n1: p k4 p", "4: k4\n3: c4b\n2: k4\n1: k4",
        "yarn A: yarn=tube\n5: p k8\n4: p k8\n3: p k8\n2: p c8b\n1: p k8", "3: k4\n2: c2f c2b\n1: k4",
        // Yarn overs away from their decreases.
        "2: k6\n1: k k2tog k yo k2", "2: k6\n1: k yo k2 ssk k",
        // Yarns that float.
        "yarn A:\nyarn B:\n2: k4 [A B B A]\n1: k4 [A A B A]",
        "yarn A:\nyarn B:\nyarn C:\n2: k4 [A B C B]\n1: k2 p k [A B A A]"}) {
    const std::string chart_text = text;
    CAPTURE(chart_text);
    const ChartText chart = test::need(read_chart(text, "chart"));
    const DrawnKnit knit = draw_knit(chart.knit, "chart");
    const StitchPattern& drawn = knit.pattern;
    REQUIRE(validate(drawn, "chart"));
    CHECK(text_of(links_of(chart.knit, knit)) == text_of(expected(chart.knit)));
    const RelaxResult relaxed = rested(chart.knit, knit);
    CHECK(relaxed.has_settled);  // what find_stitch() accepts
    const auto columns = static_cast<int>(chart.knit.rows.front().size());
    CHECK(passes_of(links_of(chart.knit, {relaxed.pattern, relaxed.parts}), columns) ==
          passes_of(expected(chart.knit), columns));
    const double overlap = -test::need(minimum_clearance(relaxed.pattern, "")) / drawn.yarns[0].radius_mm;
    MESSAGE("overlap: ", overlap, " of the radius");
    CHECK(overlap <= touching_overlap);
  }
}

TEST_CASE(
    "the right half of a front cable lies in front and goes to the left, and the left half of a back one") {
  for (const bool front : {true, false}) {
    CAPTURE(front);
    const std::string cable = front ? "c4f" : "c4b";
    const ChartText chart =
        test::need(read_chart("4: p k4 p\n3: p k4 p\n2: p " + cable + " p\n1: p k4 p", "chart"));
    const RelaxResult relaxed = rested(chart.knit, draw_knit(chart.knit, "chart"));
    const auto below = courses_of(chart.knit, {relaxed.pattern, relaxed.parts})[0];
    REQUIRE(below.size() == 6);
    int right_way = 0;
    for (const std::size_t left : {1U, 2U}) {
      for (const std::size_t right : {3U, 4U}) {
        const auto [in_front, behind] = crossings_of(below[right], below[left]);
        right_way += front ? in_front : behind;
        CHECK((front ? behind : in_front) == 0);
      }
    }
    CHECK(right_way >= 6);
  }
}

TEST_CASE("as drawn, yarns have the room that relaxation begins with, and the widest cables their links") {
  for (const char* text :
       {"1: k p", "3: p k2 p\n2: p c2f p\n1: p k2 p", "2: k4\n1: c4b", "4: k8\n3: c8f\n2: k8\n1: k8",
        "4: k9\n3: p c8b\n2: k9\n1: k9", "1: c2f k", "4: k12\n3: k ssk k5 yo k4\n2: p12\n1: p yo k8 k2tog k",
        "yarn A: radius_mm=0.3\nyarn B: radius_mm=0.6\n2: k4 [A2 B2]\n1: k ssk yo k [A B A B]",
        "yarn A:\nyarn B:\nyarn C:\nyarn D:\n1: k4 [A B C D]",
        // Turned, made, slipped, tucked; decreases of three; cables of other halves.
        "1: k ktbl", "2: ptbl k\n1: k p", "2: k4\n1: k m1l k2tog k", "2: k4\n1: k ssk m1r k",
        "2: k4\n1: k p2tog yo k", "2: k5\n1: k yo cdd yo k", "2: k5\n1: yo k3tog yo k2",
        "2: k5\n1: k2 yo sssk yo", "2: p5\n1: k yo sk2p yo k", "2: k5\n1: k yo p3tog yo k",
        "3: k3\n2: k slwyib k\n1: k3", "3: k3\n2: k slwyif k\n1: k3", "3: p2\n2: k slwyib\n1: k slwyif",
        "4: k2\n3: k slwyib\n2: k slwyib\n1: k p", "3: k3\n2: k tuck k\n1: k3",
        "yarn A:\nyarn B:\n2: k slwyib [B]\n1: k2 [A]", "4: k2 tuck k\n3: k4\n2: tuck k3\n1: k4",
        "4: p2 tuck p\n3: p4\n2: tuck p3\n1: p4", "float: 3\nyarn A:\nyarn B:\n1: k9 [A8 B]\n2: k9 [B A8]"}) {
    const std::string chart_text = text;
    CAPTURE(chart_text);
    const KnitChart chart = test::need(read_chart(text, "chart")).knit;
    DrawnKnit drawn = draw_knit(chart, "chart");
    CHECK(text_of(links_of(chart, drawn)) == text_of(expected(chart)));
    for (Yarn& yarn : drawn.pattern.yarns) yarn.radius_mm *= RelaxOptions().start_fraction;
    CHECK(test::need(minimum_clearance(drawn.pattern, "")) > 0);
  }
}

TEST_CASE("cables over purl keep their links, and their knit stitches lie in front") {
  for (const char* text : {"4: p5\n3: p 2/1rpc p\n2: p5\n1: p 2/1lpc p", "4: k4\n3: t3b k\n2: k4\n1: k t3f",
                           "2: p6\n1: p t4f p"}) {
    const std::string chart_text = text;
    CAPTURE(chart_text);
    const KnitChart chart = test::need(read_chart(text, "chart")).knit;
    DrawnKnit drawn = draw_knit(chart, "chart");
    const std::size_t columns = chart.rows.front().size();
    CHECK(text_of(between_stitches(links_of(chart, drawn), columns)) ==
          text_of(between_stitches(expected(chart), columns)));
    for (Yarn& yarn : drawn.pattern.yarns) yarn.radius_mm *= RelaxOptions().start_fraction;
    CHECK(test::need(minimum_clearance(drawn.pattern, "")) > 0);
  }
}

TEST_CASE("cloths of the same loop lie beside plain knit as published and as knitters have them") {
  struct Cloth {
    const char* chart;
    V2d min, max;         // of a stitch's width and height, of plain knit's
    double min_slid = 0;  // of yarn from a stitch into the next, as a part of its length in the table
  };
  // Spencer, "Knitting Technology": a relaxed rib is between half and 0.7 as wide; ranges of practice.
  const char* cable =
      "8: p2 k6 p2\n7: p2 k6 p2\n6: p2 k6 p2\n5: p2 c6f p2\n4: p2 k6 p2\n3: p2 k6 p2\n2: p2 k6 p2\n1: p2 k6 "
      "p2";
  const char* floats = "yarn A: albedo=#d8cfc0\nyarn B: albedo=#7a2e2e\n1: k24 [A14 B6 A4]";
  for (const Cloth& cloth :
       {Cloth{"1: k", {0.999, 0.999}, {1.001, 1.001}}, Cloth{"1: k p", {0.5, 0.9}, {0.75, 1.1}},
        Cloth{"1: k2 p2", {0.55, 0.9}, {0.8, 1.1}}, Cloth{"2: p\n1: k", {0.9, 0.6}, {1.2, 0.75}},
        Cloth{cable, {0.65, 0.9}, {0.85, 1.1}, 0.01}, Cloth{floats, {0.85, 1}, {1, 1.15}}}) {
    CAPTURE(cloth.chart);
    ChartText chart = test::need(read_chart(cloth.chart, "chart"));
    chart.knit.yarns.front().flattening = 0.6;
    const DrawnKnit knit = draw_knit(chart.knit, "chart");
    const RelaxResult relaxed = rested(chart.knit, knit);
    CHECK(relaxed.residual <= max_rest_residual);
    const V2d drawn = knit.pattern.period_mm;
    for (unsigned i = 0; i < 2; ++i) {
      const double ratio = relaxed.pattern.period_mm[i] / drawn[i];
      CHECK(ratio >= cloth.min[i]);
      CHECK(ratio <= cloth.max[i]);
    }
    // Rows keep their length of yarn to 0.5 %, 95 % of stitches to 10 % of the table.
    int near = 0;
    int loops = 0;
    double farthest = 0;
    for (std::size_t y = 0; y < relaxed.parts.size(); ++y) {
      double row = 0;
      double table = 0;
      bool has_floats = false;  // which give their loops yarn
      std::size_t segment = 0;
      for (std::size_t p = 0; p < relaxed.parts[y].size(); ++p) {
        const KnitPart& part = relaxed.parts[y][p];
        double length = 0;
        for (std::size_t k = 0; k < 8 * part.segments; ++k) {
          const BezierSegment& s = relaxed.pattern.yarns[y].segments[segment + k / 8];
          length += derivative_at(s, 0.125 * (static_cast<double>(k % 8) + 0.5)).length() / 8;
        }
        segment += part.segments;
        has_floats = has_floats || !part.is_loop;
        if (!part.is_loop) continue;
        row += length;
        table += part.length_mm;
        const double slid = std::abs(length / part.length_mm - 1);
        farthest = std::max(farthest, slid);
        near += slid <= 0.1 ? 1 : 0;
        ++loops;
      }
      CHECK((has_floats || row == doctest::Approx(table).epsilon(0.005)));
    }
    CHECK(near >= 0.95 * loops);
    CHECK(farthest >= cloth.min_slid);
    CHECK(rested(chart.knit, knit).pattern == relaxed.pattern);
  }
}

TEST_CASE("a knit that leans keeps its links from each repeat to the next above it") {
  KnitChart chart = test::need(read_chart("1: k tbl", "")).knit;
  RelaxResult relaxed = rested(chart, draw_knit(chart, ""));
  REQUIRE(relaxed.lean_repeats > 1);
  const auto lean_repeats = static_cast<std::size_t>(relaxed.lean_repeats);
  chart.rows.resize(lean_repeats, chart.rows[0]);
  relaxed.parts.resize(lean_repeats, relaxed.parts[0]);
  const StitchPattern closed = close_lean(relaxed.pattern, relaxed.lean, relaxed.lean_repeats);
  REQUIRE(validate(closed, ""));
  CHECK(passes_of(links_of(chart, {closed, relaxed.parts}), 1) == passes_of(expected(chart), 1));
}

TEST_CASE("stripes rest as one row of them does") {
  const KnitChart chart = test::need(read_chart("yarn A:\nyarn B:\n2: k [B]\n1: k [A]", "")).knit;
  KnitChart row = chart;
  row.rows.resize(1);
  const RelaxResult stripes = rested(chart, draw_knit(chart, ""));
  const RelaxResult one = rested(row, draw_knit(row, ""));
  CHECK(stripes.pattern.period_mm == one.pattern.period_mm * V2d(1, 2));
  CHECK(stripes.free_mm == one.free_mm * V2d(1, 2));
  const auto& [first, second] = std::tie(stripes.pattern.yarns.at(0), stripes.pattern.yarns.at(1));
  CHECK(first == one.pattern.yarns[0]);
  CHECK(second.squeezes == first.squeezes);
  CHECK(second.albedo == chart.yarns[1].albedo);
  for (std::size_t k = 0; k < first.segments.size(); ++k)
    CHECK(second.segments[k][0] == first.segments[k][0] + V3d(0, one.pattern.period_mm.y, 0));
}

TEST_CASE("equal stitches of a large knit rest equal, and all of plain knit as one stitch does") {
  struct Cloth {
    const char* repeat;
    std::size_t times;  ///< beside each other
  };
  const std::vector<Cloth> cloths{
      {"1: k", 144},
      {"yarn A:\nyarn B:\n4: k6 [A6]\n3: k6 [A2 B3 A]\n2: k6 [A B4 A]\n1: k6 [B A5]", 8},
      {"4: k4\n3: k sl k2\n2: k sl k2\n1: k4", 9}};
  for (const Cloth& cloth : cloths) {
    CAPTURE(cloth.repeat);
    const KnitChart one = test::need(read_chart(cloth.repeat, "")).knit;
    KnitChart chart = one;
    for (std::size_t y = 0; y < chart.rows.size(); ++y)
      for (std::size_t k = 1; k < cloth.times; ++k)
        chart.rows[y].insert(chart.rows[y].end(), one.rows[y].begin(), one.rows[y].end());
    const RelaxResult relaxed = rested(chart, draw_knit(chart, ""));
    const double radius = relaxed.pattern.yarns[0].radius_mm;
    CHECK(-test::need(minimum_clearance(relaxed.pattern, "")) <= touching_overlap * radius);
    const V3d step(relaxed.pattern.period_mm.x / static_cast<double>(cloth.times), 0, 0);
    for (const Yarn& yarn : relaxed.pattern.yarns) {
      const std::size_t count = yarn.segments.size() / cloth.times;
      double apart = 0;
      for (std::size_t k = 0; k + count < yarn.segments.size(); ++k)
        apart = std::max(apart, (yarn.segments[k + count][0] - yarn.segments[k][0] - step).length());
      CHECK(apart < 4e-6 * radius);  // drawings are rounded to 1e-6
    }
    if (chart.rows.size() > 1) continue;
    const RelaxResult single = rested(one, draw_knit(one, ""));
    CHECK(relaxed.radius_fraction == doctest::Approx(single.radius_fraction).epsilon(1e-3));
    CHECK(step.x == doctest::Approx(single.pattern.period_mm.x).epsilon(1e-3));
    const auto& segments = single.pattern.yarns[0].segments;
    for (std::size_t k = 0; k < segments.size(); ++k) {
      const V3d way = segments[k][0] - segments[0][0];
      const auto& large = relaxed.pattern.yarns[0].segments;
      CHECK((large[k][0] - large[0][0] - way).length() < touching_overlap * radius);
    }
  }
}

TEST_CASE("an edited knit rests as its chart says where it changed, and stays elsewhere") {
  const auto chart_of = [](const std::string& row, const std::string& rest = "k14 [A14]") {
    std::string text = "yarn A:\nyarn B:\n3: " + row;
    for (const int number : {1, 2, 4, 5, 6, 7, 8, 9}) text += "\n" + std::to_string(number) + ": " + rest;
    return test::need(read_chart(text, "")).knit;
  };
  const KnitChart chart = chart_of("k14 [A6 B A7]");
  const DrawnKnit knit = draw_knit(chart, "");
  const RestedKnit last{knit.pattern, knit.parts, rested(chart, knit)};
  // Stitches of another colour, purled; and a row that loses its second yarn.
  for (const char* row : {"k6 p2 k6 [A6 B2 A6]", "k6 p k7 [A14]"}) {
    CAPTURE(row);
    const KnitChart edited = chart_of(row);
    const DrawnKnit drawn = draw_knit(edited, "");
    const RelaxResult relaxed = rested(edited, drawn, {}, &last);
    REQUIRE(relaxed.is_edit);
    CHECK(passes_of(links_of(edited, {relaxed.pattern, relaxed.parts}), 14) ==
          passes_of(expected(edited), 14));
    const double overlap =
        -test::need(minimum_clearance(relaxed.pattern, "")) / knit.pattern.yarns[0].radius_mm;
    CHECK(overlap <= touching_overlap);
    CHECK(relaxed.residual <= max_rest_residual);
    const auto nodes = [](const RelaxResult& result) {
      return result.pattern.yarns[result.pattern.yarns.size() - 3].segments;
    };
    for (std::size_t k = 0; k < nodes(relaxed).size(); ++k)
      CHECK((nodes(relaxed)[k][0] - nodes(last.relaxed)[k][0]).length() < 1e-6);
  }
  const KnitChart other = test::need(read_chart("2: k\n1: p", "")).knit;
  const DrawnKnit drawn = draw_knit(other, "");
  CHECK(rested(other, drawn, {}, &last).pattern == rested(other, drawn).pattern);
}

TEST_CASE("the progress of a knit rises with its steps, so that it tells the time left") {
  const KnitChart chart = test::need(read_chart("2: k p p k\n1: k k p p", "chart")).knit;
  std::vector<double> fractions;
  const RelaxResult relaxed =
      rested(chart, draw_knit(chart, "chart"), [&](double fraction) { fractions.push_back(fraction); });
  CHECK(static_cast<int>(fractions.size()) == relaxed.steps);
  CHECK(std::ranges::is_sorted(fractions));
  CHECK(fractions.front() < 0.02);
  const double half = fractions[fractions.size() / 2];
  CHECK(half > 0.3);
  CHECK(half < 0.8);
  CHECK(fractions.back() <= 1);
}
