#include "apps/report/chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

std::string tick_text(double value) {
  const double size = std::abs(value);
  if (size >= 1e6) return fmt::format("{:g} M", value / 1e6);
  if (size >= 1e3) return fmt::format("{:g} k", value / 1e3);
  return fmt::format("{:g}", std::round(value * 1e6) / 1e6 + 0.0);  // no -0
}

}  // namespace

double Axis::share(double value) const {
  if (logarithmic) return std::log(value / low) / std::log(high / low);
  return (value - low) / (high - low);
}

double round_up(double value) {
  if (!(value > 0)) return 1;
  const double unit = std::pow(10, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (value <= step * unit * (1 + 1e-9)) return step * unit;
  }
  return 10 * unit;
}

Axis linear_axis(double low, double high) {
  Axis axis{low, high, false, {}};
  const double step = round_up((high - low) / 7);
  for (double at = std::ceil(low / step - 1e-9) * step; at <= high + 1e-9 * step; at += step)
    axis.ticks.push_back({at, tick_text(at)});
  return axis;
}

Axis axis_from_zero(double value) {
  const double step = round_up(value / 5);
  return linear_axis(0, step * std::max(1.0, std::ceil(value / step - 1e-9)));
}

Axis logarithmic_axis(double low, double high) {
  Axis axis{low, high, true, {}};
  for (double unit = std::pow(10, std::floor(std::log10(low))); unit <= high; unit *= 10) {
    for (const double at : {unit, 2 * unit, 5 * unit}) {
      if (at >= low && at <= high) axis.ticks.push_back({at, tick_text(at)});
    }
  }
  return axis;
}

void draw_chart(Svg& svg, const V2d& corner, const V2d& size, const Chart& chart) {
  using Anchor = Svg::Anchor;
  const auto at = [&](const V2d& p) {
    return corner + V2d(chart.x.share(p.x), 1 - chart.y.share(p.y)) * size;
  };
  const V2d end = corner + size;
  svg.text(corner - V2d(40, 38), chart.title, 16, ink, Anchor::start, true);
  svg.text(corner - V2d(40, 18), chart.subtitle, 12, muted);
  svg.box(corner, size, panel);
  for (const Axis::Tick& tick : chart.x.ticks) {
    const double x = at({tick.at, chart.y.low}).x;
    svg.line({{x, corner.y}, {x, end.y}}, 1, hairline);
    svg.text({x, end.y + 18}, tick.text, 12, muted, Anchor::middle);
  }
  for (const Axis::Tick& tick : chart.y.ticks) {
    const double y = at({chart.x.low, tick.at}).y;
    svg.line({{corner.x, y}, {end.x, y}}, 1, hairline);
    svg.text({corner.x - 8, y + 4}, tick.text, 12, muted, Anchor::end);
  }
  svg.text({corner.x + size.x / 2, end.y + 40}, chart.below, 12, ink, Anchor::middle);
  for (const Series& series : chart.series) {
    std::vector<V2d> points;
    for (const V2d& p : series.points) points.push_back(at(p));
    if (series.line > 0) svg.line(points, series.line, series.colour);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (series.disc > 0) {
        svg.disc(points[i], series.disc + 1, panel);
        svg.disc(points[i], series.disc, series.colour);
      }
      if (i < series.labels.size())
        svg.text(points[i] + series.label_offset, series.labels[i], 11, series.colour, Anchor::middle);
    }
  }
}

}  // namespace selvedge
