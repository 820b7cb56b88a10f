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
  double cost_low = HUGE_VAL;  // log10
  double cost_high = -HUGE_VAL;
  double quality_low = HUGE_VAL;
  double quality_high = -HUGE_VAL;

  explicit Axes(const std::vector<TradeFigure>& figures) {
    for (const TradeFigure& f : figures) {
      cost_low = std::min(cost_low, std::log10(f.cost));
      cost_high = std::max(cost_high, std::log10(f.cost));
      quality_low = std::min(quality_low, f.quality);
      quality_high = std::max(quality_high, f.quality);
    }
    // A little air around the points.
    const auto widen = [](double& low, double& high, double min_size) {
      const double size = std::max(min_size, high - low);
      high = low + 1.06 * size;
      low -= 0.06 * size;
    };
    widen(cost_low, cost_high, 0.3);
    widen(quality_low, quality_high, 0.01);
  }

  V2d at(double cost, double quality) const {
    return corner + V2d((std::log10(cost) - cost_low) / (cost_high - cost_low),
                        (quality_high - quality) / (quality_high - quality_low)) *
                        frame;
  }
};

std::string cost_text(double cost) {
  if (cost >= 1e6) return fmt::format("{:g} M", cost / 1e6);
  if (cost >= 1e3) return fmt::format("{:g} k", cost / 1e3);
  return fmt::format("{:g}", cost);
}

void draw_axes(Page& page, const TradePlot& plot, const Axes& axes) {
  const V2d end = corner + frame;
  page.text({corner.x, 20}, plot.title, 14, ink, Page::Anchor::start, true);
  page.box(corner, frame, panel);
  for (int decade = static_cast<int>(std::floor(axes.cost_low)); decade <= axes.cost_high; ++decade) {
    for (const double step : {1.0, 2.0, 5.0}) {
      const double cost = step * std::pow(10, decade);
      const double x = axes.at(cost, 0).x;
      if (x < corner.x || x > end.x) continue;
      page.line({{x, corner.y}, {x, end.y}}, 1, hairline);
      page.text({x, end.y + 16}, cost_text(cost), 11, muted, Page::Anchor::middle);
    }
  }
  const double step = round_up((axes.quality_high - axes.quality_low) / 7);
  for (double q = std::ceil(axes.quality_low / step) * step; q <= axes.quality_high; q += step) {
    const double y = axes.at(1, q).y;
    page.line({{corner.x, y}, {end.x, y}}, 1, hairline);
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
    const TradeFigure& f = plot.figures[i];
    if (!(std::isfinite(f.cost) && f.cost > 0 && std::isfinite(f.quality))) continue;
    figures.push_back(f);
    labels.push_back(fmt::format("{}", i + 1));
  }
  Drawing drawing{width, height, plot.title, {255, 255, 255}, {}};
  if (figures.empty()) return drawing;
  const Axes axes(figures);
  Page page;
  draw_axes(page, plot, axes);
  const std::vector<bool> on_front = pareto_front(figures);
  std::vector<V2d> front;
  for (std::size_t i = 0; i < figures.size(); ++i) {
    if (on_front[i]) front.push_back(axes.at(figures[i].cost, figures[i].quality));
  }
  std::sort(front.begin(), front.end(), [](const V2d& a, const V2d& b) { return a.x < b.x; });
  std::vector<V2d> steps;
  for (const V2d& at : front) {
    if (!steps.empty()) steps.emplace_back(at.x, steps.back().y);
    steps.push_back(at);
  }
  steps.emplace_back(corner.x + frame.x, steps.back().y);
  page.line(steps, 2, held_out_colour);
  for (std::size_t i = 0; i < figures.size(); ++i) {
    const V2d at = axes.at(figures[i].cost, figures[i].quality);
    page.disc(at, on_front[i] ? 4.5 : 3.5, on_front[i] ? held_out_colour : training_colour);
    page.text(at + V2d(6, -4), labels[i], on_front[i] ? 11 : 9, on_front[i] ? ink : muted);
  }
  drawing.shapes = page.take();
  return drawing;
}

}  // namespace selvedge
