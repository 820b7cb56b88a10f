#include "apps/report/compare_tiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "apps/report/chart.h"
#include "format/fabric/evaluate.h"

namespace selvedge {
namespace {

using Anchor = Svg::Anchor;

constexpr std::size_t max_tiles = 6;
constexpr double tiles_left = 160;
constexpr double tiles_right = 1300;
constexpr double gap = 14;

/// Degrees around it from u, in [0, 360).
double azimuth_of(const V3f& direction) {
  const double radians = std::atan2(static_cast<double>(direction.y), static_cast<double>(direction.x));
  return std::fmod(radians * 180 / std::numbers::pi + 360, 360.0);
}

std::string angles_text(const V3f& direction) {
  return fmt::format("{:.0f}° / {:.0f}°", angle_of(direction), azimuth_of(direction));
}

/// The value that a share of them does not pass; 1 where that is not positive.
double quantile(std::vector<double> values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[at] > 0 ? values[at] : 1;
}

/// Opacity times radiance of one pair at level 0, one value a texel.
struct Tile {
  std::vector<V3f> truth;
  std::array<std::vector<V3f>, 2> shown;  ///< by the fit, and by the model where there is one

  /// Of luminance (ITU-R BT.709), shown - truth.
  double difference(std::size_t which, std::size_t texel) const {
    const V3d d = V3d(shown[which][texel]) - V3d(truth[texel]);
    return 0.2126 * d.x + 0.7152 * d.y + 0.0722 * d.z;
  }
  /// 99.9 % of the truth's values are below it.
  double white() const {
    std::vector<double> values;
    for (const V3f& c : truth) values.push_back(static_cast<double>(std::max({c.x, c.y, c.z})));
    return quantile(std::move(values), 0.999);
  }
};

Tile tile_of(const Fabric& fabric, const PairSamples& held_out, const PairAnswers& model, std::size_t pair) {
  const FabricLevel& level = fabric.levels.front();
  const DirectionPair& directions = held_out.pairs[pair];
  Tile tile;
  for (int t = 0; t < level.texels(); ++t) {
    const std::size_t from = pair * level.texels() + t;
    tile.truth.push_back(held_out.radiance[from] * held_out.alpha[from]);
    const Shading s =
        evaluate(level, fabric, t % level.width, t / level.width, directions.light, directions.view);
    tile.shown[0].push_back(s.radiance * s.alpha);
    if (!model.empty()) tile.shown[1].push_back(model.front()[from].radiance * model.front()[from].alpha);
  }
  return tile;
}

/// Of that size in pixels, each texel a block of one colour: viewers of SVG differ in how they enlarge.
template <class Colour>
Image image_of(const V2i& texels, const V2d& size, const Colour& colour) {
  Image image{static_cast<int>(size.x), static_cast<int>(size.y), 3, {}};
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const V3f c = colour(y * texels.y / image.height * texels.x + x * texels.x / image.width);
      image.pixels.insert(image.pixels.end(), {c.x, c.y, c.z});
    }
  }
  return image;
}

void draw_light(Svg& svg, const V2d& at) {
  svg.disc(at, 5.5, ink);
  svg.disc(at, 4.5, "#f0b414");
}

/// The hemisphere from above, its rim being the horizon, with both directions.
void draw_dial(Svg& svg, const V2d& centre, const DirectionPair& pair) {
  constexpr double radius = 21;
  svg.disc(centre, radius + 1, hairline);
  svg.disc(centre, radius, panel);
  svg.line({centre - V2d(radius, 0), centre + V2d(radius, 0)}, 1, hairline);
  svg.line({centre - V2d(0, radius), centre + V2d(0, radius)}, 1, hairline);
  const auto place = [&](const V3f& direction) {
    const double angle = azimuth_of(direction) * std::numbers::pi / 180;
    return centre + V2d(std::cos(angle), -std::sin(angle)) * (radius * angle_of(direction) / 90);
  };
  draw_light(svg, place(pair.light));
  svg.disc(place(pair.view), 4.5, ink);
}

}  // namespace

double angle_of(const V3f& direction) {
  return std::acos(std::clamp(static_cast<double>(direction.z), -1.0, 1.0)) * 180 / std::numbers::pi;
}

std::vector<std::size_t> spread_pairs(const std::vector<DirectionPair>& pairs, std::size_t count) {
  std::vector<std::size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto flatter = [&](std::size_t i) { return std::min(pairs[i].view.z, pairs[i].light.z); };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return flatter(a) > flatter(b); });
  if (order.size() <= count) return order;
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < count; ++i)
    shown.push_back(order[(i * (order.size() - 1) + (count - 1) / 2) / (count - 1)]);
  return shown;
}

V3f diverging_colour(double t) {
  // Oklab (Ottosson 2020): lightness 0.975 in the middle and 0.45 at both ends.
  constexpr float middle = 0.967F;
  const V3f end = t < 0 ? V3f(0, 0.322F, 0.660F) : V3f(0.599F, 0.136F, 0.115F);
  V3f colour;
  for (int c = 0; c < 3; ++c) {
    const float share = std::min(static_cast<float>(std::abs(t)), 1.0F);
    colour[c] = srgb_to_linear(middle + (end[c] - middle) * share);
  }
  return colour;
}

Result<double> draw_tiles(Svg& svg, const Fabric& fabric, const ComparedPairs& held_out,
                          const ComparedAnswers& model, double top) {
  const FabricLevel& level = fabric.levels.front();
  const std::vector<std::size_t> shown = spread_pairs(held_out.pairs.pairs, max_tiles);
  std::vector<Tile> tiles;
  std::vector<double> differences;
  for (const std::size_t pair : shown) {
    tiles.push_back(tile_of(fabric, held_out.pairs, model.answers, pair));
    for (int t = 0; t < level.texels(); ++t) differences.push_back(std::abs(tiles.back().difference(0, t)));
  }
  const double scale = round_up(quantile(std::move(differences), 0.99));

  // As the cloth lies, a texel being a whole number of pixels along u where there is room.
  const double room = (tiles_right - tiles_left - gap * (max_tiles - 1)) / max_tiles;
  const double aspect = static_cast<double>(fabric.period_mm.y) / static_cast<double>(fabric.period_mm.x);
  V2d size(std::min(room, room / aspect), 0);
  if (size.x > level.width) size.x = level.width * std::floor(size.x / level.width);
  size.x = std::max(1.0, std::floor(size.x));
  // A cell much longer than wide is shown shorter than it is.
  size.y = std::clamp(std::round(size.x * aspect), 1.0, 2 * room);

  std::vector<const char*> rows{"truth", "fit", "fit - truth"};
  if (!model.answers.empty()) rows.insert(rows.end(), {"model", "model - truth"});
  std::vector<double> y;
  for (const char* row : rows) {
    y.push_back(top + 74 + static_cast<double>(y.size()) * (size.y + gap));
    svg.text({plot_margin, y.back() + size.y / 2 + 5}, row, 15, ink, Anchor::start, true);
  }
  for (std::size_t row = 2; row < rows.size(); row += 2)
    svg.text({plot_margin, y[row] + size.y / 2 + 24}, "luminance", 12, muted);
  svg.text({plot_margin, top + 14}, "Held-out pairs,", 13, ink, Anchor::start, true);
  svg.text({plot_margin, top + 31}, "steep to flat", 13, ink, Anchor::start, true);
  svg.disc({plot_margin + 5, top + 46}, 4.5, ink);
  svg.text({plot_margin + 15, top + 50}, "view", 12, muted);
  draw_light(svg, {plot_margin + 57, top + 46});
  svg.text({plot_margin + 67, top + 50}, "light", 12, muted);
  const auto column = [&](std::size_t i) { return tiles_left + static_cast<double>(i) * (room + gap); };
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const DirectionPair& pair = held_out.pairs.pairs[shown[i]];
    const Tile& tile = tiles[i];
    const auto white = static_cast<float>(tile.white());
    const double left = std::floor(column(i) + (room - size.x) / 2);
    const std::string view = angles_text(pair.view);
    const std::string light = angles_text(pair.light);
    draw_dial(svg, {left + 22, top + 28}, pair);
    svg.text({left + 52, top + 24}, "view " + view, 13, ink);
    svg.text({left + 52, top + 42}, "light " + light, 13, ink);
    const auto draw = [&](std::size_t row, const char* name, const auto& colour) {
      return svg.picture({left, y[row]}, image_of({level.width, level.height}, size, colour),
                         fmt::format("{}, pair {}, view {}, light {}", name, shown[i], view, light));
    };
    std::vector<Result<void>> drawn{draw(0, "truth", [&](int t) { return tile.truth[t] / white; })};
    const V2d below(left + size.x / 2, y.back() + size.y);
    for (std::size_t which = 0; 2 * which + 2 < rows.size(); ++which) {
      drawn.push_back(
          draw(2 * which + 1, rows[2 * which + 1], [&](int t) { return tile.shown[which][t] / white; }));
      drawn.push_back(draw(2 * which + 2, which == 0 ? "difference" : rows[4],
                           [&](int t) { return diverging_colour(tile.difference(which, t) / scale); }));
      const Comparison& comparison = which == 0 ? held_out.comparison : *model.comparison;
      svg.text(below + V2d(0, which == 0 ? 24 : 62),
               fmt::format("{}{:.2f} dB", which == 0 ? "" : "model ", comparison.by_pair[shown[i]].psnr), 17,
               ink, Anchor::middle, true);
    }
    for (const auto& ok : drawn) {
      if (!ok) return tl::unexpected(ok.error());
    }
    svg.text(below + V2d(0, 42), fmt::format("white is {:.2g} 1/sr", static_cast<double>(white)), 12, muted,
             Anchor::middle);
  }
  const V2d bar(std::floor(column(shown.size())) + 2, y[2]);
  const int steps = static_cast<int>(size.y);
  const Image ramp =
      image_of({1, steps}, {14, size.y}, [&](int t) { return diverging_colour(1 - 2 * (t + 0.5) / steps); });
  if (auto ok = svg.picture(bar, ramp, "scale of the differences"); !ok) return tl::unexpected(ok.error());
  svg.text(bar + V2d(20, 11), fmt::format("+{:g}", scale), 12, ink);
  svg.text(bar + V2d(20, size.y / 2 + 4), "0", 12, ink);
  svg.text(bar + V2d(20, size.y), fmt::format("-{:g}", scale), 12, ink);
  svg.text(bar + V2d(20, size.y + 18), "1/sr", 12, muted);
  return y.back() + size.y + (model.answers.empty() ? 42 : 62);
}

}  // namespace selvedge
