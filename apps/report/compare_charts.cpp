#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "apps/report/plot_page.h"

namespace selvedge {
namespace {

using Anchor = DrawnText::Anchor;

/// Axes of a chart.
struct Chart {
  V2d corner;
  V2d size;
  double max_x = 1;
  double max_y = 1;

  V2d at(double x, double y) const {
    return {corner.x + size.x * x / max_x, corner.y + size.y * (1 - y / max_y)};
  }
};

/// The end of an axis from 0 with its step: the least multiple of a round step above the value.
std::pair<double, double> axis_for(double value) {
  const double step = round_up(value / 5);
  return {step * std::max(1.0, std::ceil(value / step - 1e-9)), step};
}

void draw_axes(Page& page, Chart& chart, const char* title, const char* subtitle, double most,
               const char* unit) {
  const auto [end, step] = axis_for(most);
  chart.max_y = end;
  page.text({chart.corner.x - 40, chart.corner.y - 38}, title, 16, ink, Anchor::start, true);
  page.text({chart.corner.x - 40, chart.corner.y - 18}, subtitle, 12, muted);
  page.box(chart.corner, chart.size, panel);
  for (double y = 0; y <= end * (1 + 1e-9); y += step) {
    page.line({chart.at(0, y), chart.at(chart.max_x, y)}, 1, hairline);
    page.text(chart.at(0, y) + V2d(-8, 4), fmt::format("{:g}{}", std::round(y * 1e6) / 1e6, unit), 12, muted,
              Anchor::end);
  }
}

/// The relative L2 error of pairs whose direction lies within each of some ranges of angles.
struct AngleBins {
  static constexpr int width = 15;  ///< degrees
  static constexpr std::size_t count = 90 / width;
  std::array<double, count> squared{};
  std::array<double, count> energy{};
  std::array<int, count> pairs{};

  double error(std::size_t bin) const { return std::sqrt(squared[bin] / energy[bin]); }
  bool has(std::size_t bin) const { return energy[bin] > 0; }
};

AngleBins bins_of(const ComparedPairs& compared, V3f DirectionPair::*direction) {
  AngleBins bins;
  for (std::size_t p = 0; p < compared.pairs.pairs.size(); ++p) {
    const double angle = angle_of(compared.pairs.pairs[p].*direction);
    const auto bin = std::min(static_cast<std::size_t>(angle / AngleBins::width), AngleBins::count - 1);
    bins.squared[bin] += compared.comparison.by_pair[p].squared;
    bins.energy[bin] += compared.comparison.by_pair[p].energy;
    bins.pairs[bin] += 1;
  }
  return bins;
}

void draw_bins(Page& page, const Chart& chart, const AngleBins& bins, Rgb colour, double width) {
  std::vector<V2d> points;
  for (std::size_t b = 0; b < AngleBins::count; ++b) {
    if (bins.has(b))
      points.push_back(chart.at((static_cast<double>(b) + 0.5) * AngleBins::width, bins.error(b)));
  }
  page.line(points, width, colour);
  for (const V2d& p : points) {
    page.disc(p, width + 2.5, panel);
    page.disc(p, width + 1.5, colour);
  }
}

}  // namespace

void draw_angles(Page& page, const V2d& corner, const V2d& size, const char* title,
                 const ComparedPairs& of_held_out, const ComparedPairs& of_training,
                 V3f DirectionPair::*direction) {
  Chart chart{corner, size};
  const AngleBins held_out = bins_of(of_held_out, direction);
  const AngleBins training = bins_of(of_training, direction);
  double most = 0;
  for (const AngleBins* bins : {&held_out, &training}) {
    for (std::size_t b = 0; b < AngleBins::count; ++b) {
      if (bins->has(b)) most = std::max(most, bins->error(b));
    }
  }
  chart.max_x = 90;
  draw_axes(page, chart, title, "relative L2 error at level 0; numbers: held-out pairs", most, "");
  for (int angle = 0; angle <= 90; angle += AngleBins::width) {
    page.text(chart.at(angle, 0) + V2d(0, 20), fmt::format("{}°", angle), 12, muted, Anchor::middle);
  }
  for (std::size_t b = 0; b < AngleBins::count; ++b) {
    page.text(chart.at((static_cast<double>(b) + 0.5) * AngleBins::width, 0) + V2d(0, -7),
              fmt::format("{}", held_out.pairs[b]), 11, muted, Anchor::middle);
  }
  draw_bins(page, chart, training, training_colour, 2);
  draw_bins(page, chart, held_out, held_out_colour, 3);
}

void draw_levels(Page& page, const V2d& corner, const V2d& size, const Comparison& held_out,
                 const Comparison& training) {
  Chart chart{corner, size};
  double most = 1;
  for (const Comparison* c : {&held_out, &training}) {
    for (const LevelComparison& level : c->levels) most = std::max(most, level.psnr);
  }
  const auto count = static_cast<double>(held_out.levels.size());
  chart.max_x = count;
  draw_axes(page, chart, "Error of every level", "PSNR in dB, higher is better", most * 1.06, "");
  // Where bars are narrow, the numbers go below them.
  const bool dense = held_out.levels.size() > 7;
  const double width = std::floor(chart.size.x / count * 0.42);
  const double bottom = chart.corner.y + chart.size.y;
  for (std::size_t k = 0; k < held_out.levels.size(); ++k) {
    const double middle = chart.at(static_cast<double>(k) + 0.5, 0).x;
    const auto bar = [&](const Comparison& comparison, double left, Rgb colour) {
      if (k >= comparison.levels.size()) return;
      const std::string label = fmt::format("{:.1f}", comparison.levels[k].psnr);
      const V2d top(std::round(left), std::round(chart.at(0, std::max(0.0, comparison.levels[k].psnr)).y));
      page.box(top, {width, bottom - top.y}, colour);
      if (!dense) page.text(top + V2d(width / 2, -5), label, 10, ink, Anchor::middle);
    };
    bar(held_out, middle - width - 1, held_out_colour);
    bar(training, middle + 1, training_colour);
    const LevelComparison& level = held_out.levels[k];
    page.text({middle, bottom + 20},
              dense ? fmt::format("{}", k) : fmt::format("{}x{}", level.width, level.height), 12, muted,
              Anchor::middle);
    if (dense) {
      page.text({middle, bottom + 35}, fmt::format("{:.1f}", level.psnr), 10, held_out_colour,
                Anchor::middle);
    }
  }
}

}  // namespace selvedge
