#include "converter/stitch/knit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace selvedge {
namespace {

using std::numbers::pi;

// The loop in the plane, in stitches: x = t / 2 pi + neck sin 2t, y = -height cos t in courses, t from the
// middle of one foot to that of the next.
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

/// How one loop is connected.
struct Loop {
  int sign = 1;        ///< drawn to the front (1) or to the back (-1)
  int above = 1;       ///< the same for the loop that is drawn through it
  int lean = 0;        ///< columns from the loop to that one
  bool under = false;  ///< another loop leans over it
};

class Chart {
 public:
  explicit Chart(const KnitChart& chart) : rows_(chart.rows) {}
  int columns() const { return static_cast<int>(rows_.front().size()); }
  int courses() const { return static_cast<int>(rows_.size()); }

  Loop loop(int course, int column) const {
    Loop result;
    result.sign = at(course, column) == 'p' ? -1 : 1;
    const char up = at(course + 1, column);
    if (up == 'o') result.lean = at(course + 1, column + 1) == '/' ? 1 : -1;
    result.above = at(course + 1, column + result.lean) == 'p' ? -1 : 1;
    result.under = up == '/' || up == '\\';
    return result;
  }

 private:
  static int wrapped(int index, int count) { return ((index % count) + count) % count; }
  char at(int course, int column) const {
    return rows_[wrapped(course, courses())][wrapped(column, columns())];
  }
  const std::vector<std::string>& rows_;
};

double ease(double from, double to, double low, double high, double t) {
  const double part = std::clamp((t - low) / (high - low), 0.0, 1.0);
  return from + (to - from) * 0.5 * (1 - std::cos(pi * part));
}

/// Height out of the cloth along half a loop (t from the foot's middle, 0, to the head's, pi), in depths.
double depth_of(const Loop& loop, double foot_middle, double t) {
  // Loops of a decrease lie in layers: the leaning one in front of the other, the new loop in front of both.
  const double leg_low = loop.sign;
  const double leg_high = loop.lean != 0 ? 0.75 : (loop.under ? 0.15 : loop.above);
  const double head = loop.lean != 0 ? -0.45 : (loop.under ? -1.1 : -loop.above);
  if (t < foot_crossing) return ease(foot_middle, -loop.sign, 0, foot_crossing, t);
  if (t < lower_crossing) return ease(-loop.sign, leg_low, rise_begin, rise_end, t);
  if (t < upper_crossing) return ease(leg_low, leg_high, lower_crossing, upper_crossing, t);
  return ease(leg_high, head, upper_crossing, head_crossing, t);
}

}  // namespace

StitchPattern draw_knit(const KnitChart& chart, const std::string& name) {
  const Chart loops(chart);
  StitchPattern pattern;
  pattern.name = name;
  pattern.period_mm = {chart.wale_mm * loops.columns(), chart.course_mm * loops.courses()};
  constexpr int per_loop = 32;
  for (int course = 0; course < loops.courses(); ++course) {
    Yarn yarn = chart.yarns[course % chart.yarns.size()];
    const double depth = 1.3 * yarn.radius_mm;
    const auto point = [&](int step) {
      const int column = static_cast<int>(std::floor(static_cast<double>(step) / per_loop));
      const double t = 2 * pi * (static_cast<double>(step) / per_loop - column);
      const Loop loop = loops.loop(course, column);
      const Loop beside = loops.loop(course, t < pi ? column - 1 : column + 1);
      const double from_foot = std::min(t, 2 * pi - t);
      const double foot_middle = -0.5 * (loop.sign + beside.sign);
      const double lean = 0.96 * loop.lean * ease(0, 1, 0.7, 2.6, from_foot);
      return V3d(chart.wale_mm * (column + t / (2 * pi) + neck * std::sin(2 * t) + lean),
                 chart.course_mm * (course - height * std::cos(t)),
                 depth * depth_of(loop, foot_middle, from_foot));
    };
    // Catmull-Rom through the points.
    const auto tangent = [&](int step) { return (point(step + 1) - point(step - 1)) * 0.5; };
    for (int step = 0; step < per_loop * loops.columns(); ++step) {
      const V3d a = point(step);
      const V3d b = point(step + 1);
      yarn.segments.push_back({a, a + tangent(step) / 3.0, b - tangent(step + 1) / 3.0, b});
    }
    if (yarn.name.empty()) yarn.name = fmt::format("course {}", course + 1);
    pattern.yarns.push_back(std::move(yarn));
  }
  return pattern;
}

}  // namespace selvedge
