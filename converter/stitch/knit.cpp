#include "converter/stitch/knit.h"

#include <fmt/format.h>

#include <algorithm>
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

/// Floats: how far behind the cloth, in depths, and how far above each other, in courses.
constexpr double float_depth = -2.4;
constexpr double float_pitch = 0.2;

/// How one loop is connected.
struct Loop {
  int sign = 1;         ///< drawn to the front (1) or to the back (-1)
  int above = 1;        ///< the same for the stitch that holds it
  int lean = 0;         ///< columns from the loop to that stitch
  int cable_layer = 0;  ///< in front of the loops that it passes (1) or behind them (-1)
  bool over = false;    ///< leans over another loop that the same stitch holds
  bool under = false;   ///< another loop leans over it
  bool beside = false;  ///< over: the place above it is free, a yarn over, and it leans from there
  int passed() const { return beside ? 0 : std::abs(lean); }
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
    }
    if (stitch.source_loops.size() < 2) continue;
    const int first = stitch.source_loops[0];
    Loop& over = loop_at(first);
    Loop& under = loop_at(stitch.source_loops[1]);
    over.over = under.under = true;
    over.beside = stitch.source_loops[1] == 0 && std::abs(first) == 1 &&
                  stitches[wrapped(static_cast<int>(k) + first, stitches.size())].source_loops.empty();
    if (!over.beside) over.cable_layer = 1, under.cable_layer = -1;
  }
  return loops;
}

double ease(double from, double to, double low, double high, double t) {
  const double part = std::clamp((t - low) / (high - low), 0.0, 1.0);
  return from + (to - from) * 0.5 * (1 - std::cos(pi * part));
}

/// Height out of the cloth along half a loop (t from the foot's middle, 0, to the head's, pi), in depths.
double depth_of(const Loop& loop, double foot_middle, double t) {
  // Loops of a decrease lie in layers: the leaning one in front of the other, the new loop in front of both.
  const double leg_low = loop.sign;
  const double leg_high = loop.over ? 0.75 : (loop.under ? 0.15 : loop.above);
  const double head = loop.over ? -0.45 : (loop.under ? -1.1 : -loop.above);
  if (t < foot_crossing) return ease(foot_middle, -loop.sign, 0, foot_crossing, t);
  if (t < lower_crossing) return ease(-loop.sign, leg_low, rise_begin, rise_end, t);
  if (loop.cable_layer != 0 && t < upper_crossing) {
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
      loops_.push_back(loops_below(chart, row + 1));
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
  std::vector<BezierSegment> chain(int course, std::size_t yarn, double level) const {
    std::vector<V3d> points;
    std::size_t begin = 0;
    std::size_t end = 0;
    // One column more on either side, for the tangents.
    for (int column = -1; column <= columns_; ++column) {
      if (column == 0) begin = points.size();
      if (column == columns_) end = points.size();
      for (const double t : stations(course, column, yarn))
        points.push_back(point(course, column, yarn, level, t));
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
  const Loop& loop(int course, int column) const {
    return loops_[course][wrapped(column, loops_[course].size())];
  }

  bool is_knitted(int course, int column, std::size_t yarn) const {
    const auto& row = chart_.rows[course];
    return row[wrapped(column, row.size())].yarn == yarn;
  }

  /// Parameters of the points of one column: of a loop, or of a float.
  std::vector<double> stations(int course, int column, std::size_t yarn) const {
    const bool knitted = is_knitted(course, column, yarn);
    // Legs are long where any loop of the course passes.
    const int passed = knitted ? crossings_[wrapped(course + 1, crossings_.size())].widest : 0;
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
    spread(0, pass_begin, 8);
    spread(pass_begin, pass_end, across);
    spread(pass_end, 2 * pi - pass_end, 16);
    spread(2 * pi - pass_end, 2 * pi - pass_begin, across);
    spread(2 * pi - pass_begin, 2 * pi, 8);
    return stations;
  }

  V3d point(int course, int column, std::size_t yarn, double level, double t) const {
    const auto placed = [&](double x, double y, double z) {
      return V3d(chart_.wale_mm * x, chart_.course_mm * lifted(x, y), depth_ * z);
    };
    if (!is_knitted(course, column, yarn))
      return placed(column + t / (2 * pi), course - height + level, float_depth);
    const Loop& own = loop(course, column);
    const int neighbour = t < pi ? column - 1 : column + 1;
    const double from_foot = std::min(t, 2 * pi - t);
    const bool floats = !is_knitted(course, neighbour, yarn);
    const double foot_middle = floats ? float_depth : -0.5 * (own.sign + loop(course, neighbour).sign);
    const double lean =
        own.passed() == 0
            ? 0.96 * own.lean * ease(0, 1, 0.7, 2.6, from_foot)
            : own.lean * std::clamp((from_foot - across_begin) / (across_end - across_begin), 0.0, 1.0);
    double y = course - height * std::cos(t);
    if (floats) y += ease(level, 0, 0, foot_crossing, from_foot);
    return placed(column + t / (2 * pi) + neck * std::sin(2 * t) + lean, y,
                  depth_of(own, foot_middle, from_foot));
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
  std::vector<Crossing> crossings_;       ///< below every row
  bool crosses_ = false;
  double depth_ = 0;  ///< mm
};

}  // namespace

double crossing_courses(const KnitChart& chart, int row) { return crossing_below(chart, row).band; }

StitchPattern draw_knit(const KnitChart& chart, const std::string& name) {
  const Drawing drawing(chart);
  StitchPattern pattern;
  pattern.name = name;
  pattern.period_mm = {chart.wale_mm * static_cast<double>(chart.rows.front().size()),
                       chart.course_mm * drawing.courses()};
  for (int course = 0; course < drawing.courses(); ++course) {
    const std::vector<std::size_t> yarns = drawing.yarns_of(course);
    for (std::size_t k = 0; k < yarns.size(); ++k) {
      Yarn yarn = chart.yarns[yarns[k]];
      const double level =
          float_pitch * (static_cast<double>(k) - 0.5 * static_cast<double>(yarns.size() - 1));
      yarn.segments = drawing.chain(course, yarns[k], level);
      if (yarn.name.empty()) yarn.name = fmt::format("course {}", course + 1);
      if (yarns.size() > 1) yarn.name += fmt::format(", yarn {}", yarns[k] + 1);
      pattern.yarns.push_back(std::move(yarn));
    }
  }
  return pattern;
}

}  // namespace selvedge
