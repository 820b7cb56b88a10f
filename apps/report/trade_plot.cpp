#include "apps/report/trade_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/report/plot_page.h"

namespace selvedge {
namespace {

constexpr int width = 560;
constexpr int height = 400;
constexpr V2d corner(64, 56);  // of the frame, top left
const V2d frame(width - 64 - 24, height - 56 - 56);

struct Axes {
  double cost_low, cost_high;  // log10
  double quality_low, quality_high;
  V2d at(const TradeFigure& f) const {
    const double x = (std::log10(f.cost) - cost_low) / (cost_high - cost_low);
    const double y = (f.quality - quality_low) / (quality_high - quality_low);
    return corner + V2d(x, 1 - y) * frame;
  }
};

bool is_shown(const TradeFigure& f) {
  return std::isfinite(f.cost) && f.cost > 0 && std::isfinite(f.quality);
}

Axes axes_of(const std::vector<TradeFigure>& figures) {
  Axes axes{HUGE_VAL, -HUGE_VAL, HUGE_VAL, -HUGE_VAL};
  for (const TradeFigure& f : figures) {
    axes.cost_low = std::min(axes.cost_low, std::log10(f.cost));
    axes.cost_high = std::max(axes.cost_high, std::log10(f.cost));
    axes.quality_low = std::min(axes.quality_low, f.quality);
    axes.quality_high = std::max(axes.quality_high, f.quality);
  }
  const double wide = std::max(0.3, axes.cost_high - axes.cost_low);
  const double high = std::max(0.01, axes.quality_high - axes.quality_low);
  constexpr double air = 0.06;
  return {axes.cost_low - air * wide, axes.cost_low + (1 + air) * wide, axes.quality_low - air * high,
          axes.quality_low + (1 + air) * high};
}

std::string cost_text(double cost) {
  if (cost >= 1e6) return fmt::format("{:g} M", cost / 1e6);
  if (cost >= 1e3) return fmt::format("{:g} k", cost / 1e3);
  return fmt::format("{:g}", cost);
}

void draw_axes(Page& page, const TradePlot& plot, const Axes& axes) {
  page.text({corner.x, 20}, plot.title, 14, ink, Page::Anchor::start, true);
  page.box(corner, frame, panel);
  for (int decade = static_cast<int>(std::floor(axes.cost_low)); decade <= axes.cost_high; ++decade) {
    for (const double step : {1.0, 2.0, 5.0}) {
      const double cost = step * std::pow(10, decade);
      const double x = axes.at({cost, axes.quality_low}).x;
      if (x < corner.x || x > corner.x + frame.x) continue;
      page.line({{x, corner.y}, {x, corner.y + frame.y}}, 1, hairline);
      page.text({x, corner.y + frame.y + 16}, cost_text(cost), 11, muted, Page::Anchor::middle);
    }
  }
  const double step = round_up((axes.quality_high - axes.quality_low) / 7);
  for (double q = std::ceil(axes.quality_low / step) * step; q <= axes.quality_high; q += step) {
    const double y =
        corner.y + (1 - (q - axes.quality_low) / (axes.quality_high - axes.quality_low)) * frame.y;
    page.line({{corner.x, y}, {corner.x + frame.x, y}}, 1, hairline);
    page.text({corner.x - 6, y + 4}, fmt::format("{:g}", std::round(q * 1e6) / 1e6), 11, muted,
              Page::Anchor::end);
  }
  page.text({corner.x + frame.x / 2, height - 14.0}, plot.cost, 12, ink, Page::Anchor::middle);
  page.text({corner.x, corner.y - 10}, plot.quality, 12, ink);
}

}  // namespace

Drawing trade_plot(const TradePlot& plot) {
  std::vector<TradeFigure> figures;
  std::vector<std::string> labels;
  for (std::size_t i = 0; i < plot.figures.size(); ++i) {
    if (!is_shown(plot.figures[i])) continue;
    figures.push_back(plot.figures[i]);
    labels.push_back(plot.labels[i]);
  }
  Drawing drawing{width, height, plot.title, {255, 255, 255}, {}};
  if (figures.empty()) return drawing;
  const Axes axes = axes_of(figures);
  Page page;
  draw_axes(page, plot, axes);
  const std::vector<bool> on_front = pareto_front(figures);
  std::vector<TradeFigure> front;
  for (std::size_t i = 0; i < figures.size(); ++i) {
    if (on_front[i]) front.push_back(figures[i]);
  }
  std::sort(front.begin(), front.end(),
            [](const TradeFigure& a, const TradeFigure& b) { return a.cost < b.cost; });
  std::vector<V2d> steps;
  for (const TradeFigure& f : front) {
    const V2d at = axes.at(f);
    if (!steps.empty()) steps.emplace_back(at.x, steps.back().y);
    steps.push_back(at);
  }
  steps.emplace_back(corner.x + frame.x, steps.back().y);
  page.line(steps, 2, held_out_colour);
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const V2d at = axes.at(figures[i]);
    page.disc(at, on_front[i] ? 4.5 : 3.5, on_front[i] ? held_out_colour : training_colour);
    page.text(at + V2d(6, -4), labels[i], on_front[i] ? 11 : 9, on_front[i] ? ink : muted);
  }
  drawing.shapes = page.take();
  return drawing;
}

}  // namespace selvedge
