// One plot for all: series of points over two axes.
#pragma once

#include <string>
#include <vector>

#include "apps/report/svg.h"

namespace selvedge {

struct Axis {
  struct Tick {
    double at = 0;
    std::string text;
  };
  double low = 0;
  double high = 1;
  bool logarithmic = false;
  std::vector<Tick> ticks;

  /// Where a value lies between the ends, from 0 to 1.
  double share(double value) const;
};

/// Ticks at round steps between two ends.
Axis linear_axis(double low, double high);
/// From 0 to the first round step that is not below `value`.
Axis axis_from_zero(double value);
/// Precondition: 0 < low < high.
Axis logarithmic_axis(double low, double high);

/// The next of 1, 2, 5, 10, 20 ... that is not less; 1 where the value is not positive.
double round_up(double value);

struct Series {
  std::vector<V2d> points;
  const char* colour = ink;
  double line = 0;                  ///< width of the line through the points; 0: no line
  double disc = 0;                  ///< radius of a disc at each point; 0: no discs
  std::vector<std::string> labels;  ///< of the points, or empty
  V2d label_offset;                 ///< from the point to the middle of its label, pixels
};

struct Chart {
  std::string title;
  std::string subtitle;  ///< says what the axis at the left has
  std::string below;     ///< and the other one, or empty
  Axis x;
  Axis y;
  std::vector<Series> series;
};

/// `corner`, `size`: of the frame between the axes; titles and ticks lie outside of it.
void draw_chart(Svg& svg, const V2d& corner, const V2d& size, const Chart& chart);

}  // namespace selvedge
