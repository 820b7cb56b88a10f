#include "converter/stitch/knit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

namespace selvedge {
namespace {

using std::numbers::pi;

// The loop in the plane, in stitches: x = t / 2 pi + neck sin 2t, y = -height cos t in courses, t from the
// middle of one foot to the next.
constexpr double neck = 0.236;
constexpr double height = 0.895;

// Parameters at which these loops cross: the foot with the legs of the course below, the legs with the head
// below, the legs with the foot above, the head with the legs of the course above.
constexpr double foot_crossing = 0.33;
constexpr double lower_crossing = 1.40;
constexpr double upper_crossing = pi - lower_crossing;
constexpr double head_crossing = pi - foot_crossing;
// Parameters between which a leg changes from the foot's side of the cloth to its own: after the leg of a
// loop that leans over the one below, before that loop's head.
constexpr double rise_begin = 1.0;
constexpr double rise_end = 1.22;
// Between the head below and the foot above there is nothing but legs. There loops move to other columns, by
// t: to their layer of the cloth, across, and back.
constexpr double pass_begin = 1.41;
constexpr double across_begin = 1.47;
constexpr double across_end = pi - across_begin;
constexpr double pass_end = pi - pass_begin;
const double pass_height = 2 * height * std::cos(pass_begin);      // in courses
const double across_height = 2 * height * std::cos(across_begin);  // in courses
/// Height, in courses, in which a loop moves by one column: with less, its legs would come too close.
constexpr double height_per_column = 0.33;

/// The room of a crossing ends so many columns beside it.
constexpr double band_reach = 1.5;

/// Floats: how far behind the cloth, in depths, and how far above each other, in courses; the yarn that
/// catches them lies behind them.
constexpr double float_depth = -2.4;
constexpr double float_pitch = 0.2;
constexpr double catch_depth = -3.6;

// The table of lengths (spec/chart.md), beside a knit stitch: a yarn over is wrapped about the needle and
// drawn through nothing. The legs of a crossed loop rise two courses on their way across wales that stand
// at half of plain knit's width.
constexpr double length_of_yarn_over = 0.75;
constexpr double crossed_wale = 0.5;
constexpr double crossed_courses = 2;

/// How one loop is connected.
struct Loop {
  int sign = 1;            ///< drawn to the front (1) or to the back (-1)
  int above = 1;           ///< the same for the stitch that holds it
  int lean = 0;            ///< columns from the loop to that stitch
  double cable_layer = 0;  ///< in front of the loops that it passes (1) or behind them (-1)
  int rank = 0;            ///< how many of the loops that the same stitch holds lie in front of it
  int held = 1;            ///< loops that the stitch holds
  bool free = false;       ///< the place above it is free, a yarn over, and it leans from there
  int courses = 0;         ///< that it is slipped before a stitch holds it
  bool tucked = false;     ///< lies over the loop below, which the same stitch holds
  int twist = 0;  ///< 1: its right leg crosses over its left one; -1: the left one over the right one
  int passed() const { return free ? 0 : std::abs(lean); }
  /// Place among the loops of one stitch, from the side to which it is drawn.
  int place() const { return above > 0 ? rank : held - 1 - rank; }
};

int wrapped(int index, std::size_t count) {
  const int n = static_cast<int>(count);
  return ((index % n) + n) % n;
}

/// The loops of the course below this row.
std::vector<Loop> loops_below(const KnitChart& chart, int row) {
  const auto& stitches = chart.rows[wrapped(row, chart.rows.size())];
  const auto& below = chart.rows[wrapped(row - 1, chart.rows.size())];
  std::vector<Loop> loops(stitches.size());
  for (std::size_t k = 0; k < loops.size(); ++k) loops[k].sign = below[k].purl ? -1 : 1;
  for (std::size_t k = 0; k < stitches.size(); ++k) {
    const ChartStitch& stitch = stitches[k];
    const auto loop_at = [&](int column) -> Loop& {
      return loops[wrapped(static_cast<int>(k) + column, loops.size())];
    };
    for (const int column : stitch.source_loops) {
      loop_at(column).above = stitch.purl ? -1 : 1;
      loop_at(column).lean = -column;
      loop_at(column).cable_layer = stitch.cable_layer;
      loop_at(column).twist = stitch.twist;
    }
    const auto count = static_cast<int>(stitch.source_loops.size());
    if (count < 2) continue;
    const int first = stitch.source_loops[0];
    loop_at(first).free =
        count == 2 && stitch.source_loops[1] == 0 && std::abs(first) == 1 &&
        stitches[wrapped(static_cast<int>(k) + first, stitches.size())].source_loops.empty();
    for (int rank = 0; rank < count; ++rank) {
      Loop& loop = loop_at(stitch.source_loops[rank]);
      loop.rank = rank;
      loop.held = count;
      if (!loop_at(first).free) loop.cable_layer = 1 - 2.0 * rank / (count - 1);
    }
  }
  return loops;
}

double ease(double from, double to, double low, double high, double t) {
  const double part = std::clamp((t - low) / (high - low), 0.0, 1.0);
  return from + (to - from) * 0.5 * (1 - std::cos(pi * part));
}

/// Height out of the cloth along half a loop (t from the foot's middle, 0, to the head's, pi), in depths.
double depth_of(const Loop& loop, double foot_middle, double t) {
  // Loops of a decrease lie in layers: the leaning one in front of the others, the new loop in front of all;
  // of one that is purled as seen from the back.
  constexpr std::array<std::array<double, 3>, 3> legs{{{1}, {0.75, 0.15}, {0.75, 0.3, -0.15}}};
  constexpr std::array<std::array<double, 3>, 3> heads{{{-1}, {-0.45, -1.1}, {-0.45, -1.0, -1.55}}};
  const double leg_low = loop.tucked ? -2 * loop.above : loop.sign;
  const double leg_high = loop.above * legs[loop.held - 1][loop.place()];
  const double head = loop.above * heads[loop.held - 1][loop.place()];
  if (t < foot_crossing) return ease(foot_middle, -loop.sign, 0, foot_crossing, t);
  if (t < lower_crossing) return ease(-loop.sign, leg_low, rise_begin, rise_end, t);
  if ((loop.cable_layer != 0 || loop.held > 2) && t < upper_crossing) {
    if (t < across_end) return ease(leg_low, loop.cable_layer, pass_begin, across_begin, t);
    return ease(loop.cable_layer, leg_high, across_end, pass_end, t);
  }
  if (t < upper_crossing) return ease(leg_low, leg_high, lower_crossing, upper_crossing, t);
  return ease(leg_high, head, upper_crossing, head_crossing, t);
}

/// Columns of the loops that move below a row.
struct Span {
  double from = 0;
  double to = 0;
  /// Columns that x, of a repeat of so many columns, lies from the middle, to the nearest copy.
  double from_middle(double x, int columns) const {
    const double away = x - 0.5 * (from + to);
    return away - columns * std::floor(away / columns + 0.5);
  }
};

/// The crossing below a row.
struct Crossing {
  int widest = 0;   ///< columns of the longest way, 0: nothing passes
  double band = 0;  ///< height that it takes, in courses
  std::vector<Span> spans;
};

Crossing crossing_below(const KnitChart& chart, int row) {
  const std::vector<Loop> loops = loops_below(chart, row);
  Crossing crossing;
  for (int k = 0; k < static_cast<int>(loops.size()); ++k) {
    if (loops[k].passed() == 0) continue;
    const int to = k + loops[k].lean;
    crossing.widest = std::max(crossing.widest, loops[k].passed());
    crossing.spans.push_back({1.0 * std::min(k, to), 1.0 * std::max(k, to) + 1});
  }
  if (crossing.widest == 0) return crossing;
  crossing.band = pass_height * std::max(1.0, height_per_column * crossing.widest / across_height);
  return crossing;
}

class Drawing {
 public:
  explicit Drawing(const KnitChart& chart)
      : chart_(chart), columns_(static_cast<int>(chart.rows.front().size())) {
    for (const auto& row : chart.rows) {
      for (const ChartStitch& stitch : row)
        depth_ = std::max(depth_, 1.3 * chart.yarns[stitch.yarn].radius_mm);
    }
    for (int row = 0; row < courses(); ++row) {
      loops_.push_back(loops_of(row));
      caught_.push_back(caught_floats(row));
      crossings_.push_back(crossing_below(chart, row));
      crosses_ = crosses_ || crossings_.back().band > 0;
    }
  }

  int courses() const { return static_cast<int>(chart_.rows.size()); }

  /// The yarns of a course, in the order of their floats from below.
  std::vector<std::size_t> yarns_of(int course) const {
    std::set<std::size_t> yarns;
    for (const ChartStitch& stitch : chart_.rows[course]) yarns.insert(stitch.yarn);
    return {yarns.begin(), yarns.end()};
  }

  /// The chain of one of the yarns of a course, whose floats lie `level` courses above the feet.
  std::vector<BezierSegment> chain(int course, std::size_t yarn, double level,
                                   std::vector<KnitPart>& parts) const {
    std::vector<V3d> points;
    std::size_t begin = 0;
    std::size_t end = 0;
    // One column more on either side, for the tangents.
    for (int column = -1; column <= columns_; ++column) {
      if (column == 0) begin = points.size();
      if (column == columns_) end = points.size();
      const std::vector<double> places = stations(course, column, yarn);
      for (const double t : places) points.push_back(point(course, column, yarn, level, t));
      if (column >= 0 && column < columns_)
        parts.push_back({is_knitted(course, column, yarn), length(course, column, yarn), places.size()});
    }
    // Catmull-Rom through the points.
    const auto tangent = [&](std::size_t k) { return (points[k + 1] - points[k - 1]) * 0.5; };
    std::vector<BezierSegment> segments;
    for (std::size_t k = begin; k < end; ++k) {
      const V3d a = points[k];
      const V3d b = points[k + 1];
      segments.push_back({a, a + tangent(k) / 3.0, b - tangent(k + 1) / 3.0, b});
    }
    return segments;
  }

 private:
  const ChartStitch& stitch(int course, int column) const {
    const auto& row = chart_.rows[wrapped(course, chart_.rows.size())];
    return row[wrapped(column, row.size())];
  }

  /// The loops of a course: of those that are slipped, as they are held above.
  std::vector<Loop> loops_of(int course) const {
    using Held = ChartStitch::Held;
    std::vector<Loop> loops = loops_below(chart_, course + 1);
    for (int k = 0; k < columns_; ++k) {
      Loop& loop = loops[k];
      int courses = 0;
      while (courses < max_slipped && stitch(course + courses + 1, k).held != Held::none) ++courses;
      const int sign = loop.sign;
      if (courses > 0) loop = loops_below(chart_, course + courses + 1)[k];
      loop.sign = sign;
      loop.courses = courses;
      loop.tucked = stitch(course, k).held == Held::tuck;
      const bool holds_tuck = courses > 0 && stitch(course + courses, k).held == Held::tuck;
      if (loop.tucked || holds_tuck) {
        // The tuck lies on the side from which the stitch above goes through both.
        const bool in_front = loop.tucked != (loop.above > 0);
        loop.rank = in_front ? 0 : 1;
        loop.held = 2;
        loop.cable_layer = in_front ? 1 : -1;
        if (loop.tucked) loop.sign = loop.above;
      }
      if (stitch(course, k).source_loops.empty()) loop.twist = stitch(course, k).twist;
    }
    return loops;
  }

  /// Whether the yarn passes behind floats left of each column, which catches them.
  std::vector<bool> caught_floats(int course) const {
    std::vector<bool> caught(columns_);
    const int longest = chart_.max_float;
    for (const std::size_t yarn : yarns_of(course)) {
      for (int begin = 0; longest > 0 && begin < columns_; ++begin) {
        if (stitch(course, begin - 1).yarn != yarn) continue;
        int length = 0;
        while (stitch(course, begin + length).yarn != yarn) ++length;
        const int parts = (length + longest - 1) / longest;
        for (int part = 1; part < parts; ++part) {
          const int middle = begin + part * length / parts;
          // The nearest place between two stitches of one yarn.
          for (int away = 0; 2 * away <= longest; ++away) {
            const int place = middle + (away % 2 == 0 ? 1 : -1) * ((away + 1) / 2);
            if (place <= begin || place >= begin + length ||
                stitch(course, place - 1).yarn != stitch(course, place).yarn)
              continue;
            caught[wrapped(place, columns_)] = true;
            break;
          }
        }
      }
    }
    return caught;
  }

  const Loop& loop(int course, int column) const {
    return loops_[course][wrapped(column, loops_[course].size())];
  }

  bool is_knitted(int course, int column, std::size_t yarn) const {
    using Held = ChartStitch::Held;
    const ChartStitch& own = stitch(course, column);
    return own.yarn == yarn && (own.held == Held::none || own.held == Held::tuck);
  }

  /// Depth of a yarn that passes a column.
  double float_depth_of(int course, int column, std::size_t yarn) const {
    const ChartStitch& own = stitch(course, column);
    return own.yarn == yarn && own.held == ChartStitch::Held::yarn_in_front ? -float_depth : float_depth;
  }

  /// Parameters of the points of one column: of a loop, or of a float.
  std::vector<double> stations(int course, int column, std::size_t yarn) const {
    const bool knitted = is_knitted(course, column, yarn);
    // Legs are long where any loop of the course passes.
    const Loop& own = loop(course, column);
    int passed = knitted ? crossings_[wrapped(course + own.courses + 1, crossings_.size())].widest : 0;
    if (knitted && (own.twist != 0 || own.courses > 0)) passed = std::max(passed, 1);
    std::vector<double> stations;
    if (passed == 0) {
      const int count = knitted ? 32 : 4;
      for (int k = 0; k < count; ++k) stations.push_back(2 * pi * (static_cast<double>(k) / count));
      return stations;
    }
    const auto spread = [&](double from, double to, int count) {
      for (int k = 0; k < count; ++k) stations.push_back(from + (to - from) * k / count);
    };
    const int across = 4 + 6 * passed;
    const double bend = own.courses > 0 ? lower_crossing : pass_begin;
    spread(0, bend, 8);
    spread(bend, pass_begin, 8 * own.courses);
    spread(pass_begin, pass_end, across);
    spread(pass_end, 2 * pi - pass_end, 16);
    spread(2 * pi - pass_end, 2 * pi - pass_begin, across);
    spread(2 * pi - pass_begin, 2 * pi - bend, 8 * own.courses);
    spread(2 * pi - bend, 2 * pi, 8);
    return stations;
  }

  /// Length of yarn by the table, mm.
  double length(int course, int column, std::size_t yarn) const {
    if (!is_knitted(course, column, yarn)) return chart_.wale_mm;
    const double knit = length_of_knit(chart_.wale_mm, chart_.course_mm);
    if (chart_.rows[course][column].source_loops.empty()) return length_of_yarn_over * knit;
    const Loop& own = loop(course, column);
    const double held = chart_.course_mm * own.courses;
    if (own.passed() == 0) return knit + held;
    const double across = crossed_wale * chart_.wale_mm * own.lean;
    const double up = crossed_courses * chart_.course_mm;
    return knit + held + 2 * (std::sqrt(across * across + up * up) - up);
  }

  V3d point(int course, int column, std::size_t yarn, double level, double t) const {
    const auto placed = [&](double x, double y, double z) {
      return V3d(chart_.wale_mm * x, chart_.course_mm * lifted(x, y), depth_ * z);
    };
    if (!is_knitted(course, column, yarn))
      return placed(column + t / (2 * pi), course - height + level, float_depth_of(course, column, yarn));
    Loop own = loop(course, column);
    const int neighbour = t < pi ? column - 1 : column + 1;
    const double from_foot = std::min(t, 2 * pi - t);
    const bool floats = !is_knitted(course, neighbour, yarn);
    const bool caught = !floats && caught_[course][wrapped(std::max(column, neighbour), columns_)];
    const double foot_middle = floats   ? float_depth_of(course, neighbour, yarn)
                               : caught ? catch_depth
                                        : -0.5 * (own.sign + loop(course, neighbour).sign);
    const double across = std::clamp((from_foot - across_begin) / (across_end - across_begin), 0.0, 1.0);
    if (own.twist != 0) own.cable_layer += 0.6 * (t < pi ? -own.twist : own.twist);
    const double lean =
        own.passed() == 0 ? 0.96 * own.lean * ease(0, 1, 0.7, 2.6, from_foot) : own.lean * across;
    // The head of a turned loop is passed from the right to the left.
    const double turned = own.twist == 0 ? 1 : 1 - 2 * across;
    const double x = 0.5 + turned * (t / (2 * pi) - 0.5 + neck * std::sin(2 * t));
    // A slipped loop has longer legs.
    const double longer = (from_foot - lower_crossing) / (pass_begin - lower_crossing);
    double y = course - height * std::cos(t) + own.courses * std::clamp(longer, 0.0, 1.0);
    if (floats) y += ease(level, 0, 0, foot_crossing, from_foot);
    return placed(column + x + lean, y, depth_of(own, foot_middle, from_foot));
  }

  /// A height in one column, in courses, after those where loops pass have made their room: the plane is
  /// stretched, and nothing in it crosses what it did not cross.
  double lifted(double x, double y) const {
    if (!crosses_) return y;
    double taken = 0;
    double stretched = 0;
    for (const Crossing& crossing : crossings_) {
      if (crossing.band == 0) continue;
      taken += band_at(crossing, x);
      stretched += pass_height;
    }
    const double rest = (courses() - taken) / (courses() - stretched);
    double result = rest * y;
    // Each band takes `more` than its fraction of the rest, from its lower end to its upper one.
    for (int row = 0; row < courses(); ++row) {
      if (crossings_[row].band == 0) continue;
      const double away = y - (row - 1);
      const double turns = std::floor(away / courses() + 0.5);
      const double within = (away - turns * courses()) / pass_height;
      const double more = band_at(crossings_[row], x) - rest * pass_height;
      result += more * (turns + std::clamp(within + 0.5, 0.0, 1.0));
    }
    return result;
  }

  /// Height of a crossing's band in one column: beside the crossing it is as low as elsewhere.
  double band_at(const Crossing& crossing, double x) const {
    double part = 0;
    for (const Span& span : crossing.spans) {
      const double outside = std::abs(span.from_middle(x, columns_)) - 0.5 * (span.to - span.from);
      part = std::max(part, std::clamp(1 - outside / band_reach, 0.0, 1.0));
    }
    return pass_height + part * (crossing.band - pass_height);
  }

  const KnitChart& chart_;
  int columns_;
  std::vector<std::vector<Loop>> loops_;  ///< of every course
  std::vector<std::vector<bool>> caught_;
  std::vector<Crossing> crossings_;  ///< below every row
  bool crosses_ = false;
  double depth_ = 0;  ///< mm
};

}  // namespace

double crossing_courses(const KnitChart& chart, int row) { return crossing_below(chart, row).band; }

double length_of_knit(double wale_mm, double course_mm) { return std::sqrt(23.1 * wale_mm * course_mm); }

DrawnKnit draw_knit(const KnitChart& chart, const std::string& name) {
  const Drawing drawing(chart);
  DrawnKnit drawn;
  StitchPattern& pattern = drawn.pattern;
  pattern.name = name;
  pattern.period_mm = {chart.wale_mm * static_cast<double>(chart.rows.front().size()),
                       chart.course_mm * drawing.courses()};
  for (int course = 0; course < drawing.courses(); ++course) {
    const std::vector<std::size_t> yarns = drawing.yarns_of(course);
    for (std::size_t k = 0; k < yarns.size(); ++k) {
      Yarn yarn = chart.yarns[yarns[k]];
      const double level =
          float_pitch * (static_cast<double>(k) - 0.5 * static_cast<double>(yarns.size() - 1));
      yarn.segments = drawing.chain(course, yarns[k], level, drawn.parts.emplace_back());
      for (KnitPart& part : drawn.parts.back()) part.begins_row = k == 0;
      if (yarn.name.empty()) yarn.name = fmt::format("course {}", course + 1);
      if (yarns.size() > 1) yarn.name += fmt::format(", yarn {}", yarns[k] + 1);
      pattern.yarns.push_back(std::move(yarn));
    }
  }
  return drawn;
}

}  // namespace selvedge
