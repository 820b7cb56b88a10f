#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "apps/report/colour_map.h"
#include "apps/report/compare_plot.h"
#include "apps/report/plot_page.h"
#include "format/fabric/evaluate.h"

namespace selvedge {
namespace {

using Anchor = DrawnText::Anchor;

constexpr Rgb light_colour{240, 180, 20};
constexpr std::size_t max_tiles = 6;
constexpr double tiles_left = 160;
constexpr double tiles_right = 1300;
constexpr double tile_gap = 14;

std::string angles_text(const V3f& direction) {
  return fmt::format("{:.0f}° / {:.0f}°", angle_of(direction), azimuth_of(direction));
}

/// alpha r and alpha f of one pair at level 0.
struct TilePixels {
  std::vector<V3f> truth;
  std::vector<V3f> fit;
};

TilePixels tile_pixels(const Fabric& fabric, const PairSamples& held_out, std::size_t pair) {
  const FabricLevel& level = fabric.levels.front();
  const DirectionPair& directions = held_out.pairs[pair];
  TilePixels tile;
  for (int t = 0; t < level.texels(); ++t) {
    const std::size_t from = pair * level.texels() + t;
    tile.truth.push_back(held_out.radiance[from] * held_out.alpha[from]);
    const Shading s =
        evaluate(level, fabric, t % level.width, t / level.width, directions.light, directions.view);
    tile.fit.push_back(s.radiance * s.alpha);
  }
  return tile;
}

/// ITU-R BT.709.
double luminance(const V3f& colour) {
  return 0.2126 * static_cast<double>(colour.x) + 0.7152 * static_cast<double>(colour.y) +
         0.0722 * static_cast<double>(colour.z);
}

/// The value that a share of them does not pass; 0 where there are no values.
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[at];
}

/// The value that is shown as white in truth and fit of a tile: 99.9 % of the truth's values are below it.
double white_of(const TilePixels& tile) {
  std::vector<double> values;
  for (const V3f& c : tile.truth) values.push_back(static_cast<double>(std::max({c.x, c.y, c.z})));
  const double white = quantile(std::move(values), 0.999);
  return white > 0 ? white : 1;
}

/// The end of the scale of differences: 99 % of all that are shown are below it.
double difference_scale(const std::vector<TilePixels>& tiles) {
  std::vector<double> values;
  for (const TilePixels& tile : tiles) {
    for (std::size_t t = 0; t < tile.truth.size(); ++t)
      values.push_back(std::abs(luminance(tile.fit[t] - tile.truth[t])));
  }
  return round_up(quantile(std::move(values), 0.99));
}

template <class Colour>
Image image_of(const FabricLevel& level, const Colour& colour) {
  Image image{level.width, level.height, 3, {}};
  for (int t = 0; t < level.texels(); ++t) {
    const V3f c = colour(t);
    image.pixels.insert(image.pixels.end(), {c.x, c.y, c.z});
  }
  return image;
}

/// The hemisphere from above, its rim being the horizon, with both directions.
void draw_dial(Page& page, const V2d& centre, const DirectionPair& pair) {
  constexpr double radius = 21;
  page.disc(centre, radius + 1, hairline);
  page.disc(centre, radius, panel);
  page.line({centre - V2d(radius, 0), centre + V2d(radius, 0)}, 1, hairline);
  page.line({centre - V2d(0, radius), centre + V2d(0, radius)}, 1, hairline);
  const auto place = [&](const V3f& direction) {
    const double angle = azimuth_of(direction) * std::numbers::pi / 180;
    const double reach = radius * angle_of(direction) / 90;
    return centre + V2d(reach * std::cos(angle), -reach * std::sin(angle));
  };
  page.disc(place(pair.light), 5.5, ink);
  page.disc(place(pair.light), 4.5, light_colour);
  page.disc(place(pair.view), 4.5, ink);
}

}  // namespace

double draw_tiles(Page& page, const Fabric& fabric, const PairSamples& held_out, const Comparison& comparison,
                  double top) {
  const FabricLevel& level = fabric.levels.front();
  const std::vector<std::size_t> shown = spread_pairs(held_out.pairs, max_tiles);
  std::vector<TilePixels> tiles;
  for (const std::size_t pair : shown) tiles.push_back(tile_pixels(fabric, held_out, pair));
  const double scale = difference_scale(tiles);

  // As the cloth lies, a texel being a whole number of pixels along u where there is room.
  const double room = (tiles_right - tiles_left - tile_gap * (max_tiles - 1)) / max_tiles;
  const double aspect = static_cast<double>(fabric.period_mm.y) / static_cast<double>(fabric.period_mm.x);
  // A cell much longer than wide is shown shorter than it is.
  const double tallest = 2 * room;
  V2d size(std::min(room, room / aspect), 0);
  if (size.x > level.width) size.x = level.width * std::floor(size.x / level.width);
  size.x = std::max(1.0, std::floor(size.x));
  size.y = std::clamp(std::round(size.x * aspect), 1.0, tallest);

  const double first_row = top + 74;
  const std::array<const char*, 3> rows{"truth", "fit", "fit - truth"};
  const auto row_at = [&](std::size_t row) {
    return first_row + static_cast<double>(row) * (size.y + tile_gap);
  };
  page.text({margin, top + 14}, "Held-out pairs,", 13, ink, Anchor::start, true);
  page.text({margin, top + 31}, "steep to flat", 13, ink, Anchor::start, true);
  page.disc({margin + 5, top + 46}, 4.5, ink);
  page.text({margin + 15, top + 50}, "view", 12, muted);
  page.disc({margin + 57, top + 46}, 5.5, ink);
  page.disc({margin + 57, top + 46}, 4.5, light_colour);
  page.text({margin + 67, top + 50}, "light", 12, muted);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    page.text({margin, row_at(row) + size.y / 2 + 5}, rows[row], 15, ink, Anchor::start, true);
  }
  page.text({margin, row_at(2) + size.y / 2 + 24}, "luminance", 12, muted);
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const DirectionPair& pair = held_out.pairs[shown[i]];
    const TilePixels& tile = tiles[i];
    const double left =
        std::floor(tiles_left + static_cast<double>(i) * (room + tile_gap) + (room - size.x) / 2);
    const double middle = left + size.x / 2;
    draw_dial(page, {left + 22, top + 28}, pair);
    page.text({left + 52, top + 24}, "view " + angles_text(pair.view), 13, ink);
    page.text({left + 52, top + 42}, "light " + angles_text(pair.light), 13, ink);
    const auto white = static_cast<float>(white_of(tile));
    const std::string title =
        fmt::format("pair {}, view {}, light {}", shown[i], angles_text(pair.view), angles_text(pair.light));
    page.picture({left, row_at(0)}, size, image_of(level, [&](int t) { return tile.truth[t] / white; }),
                 "truth, " + title);
    page.picture({left, row_at(1)}, size, image_of(level, [&](int t) { return tile.fit[t] / white; }),
                 "fit, " + title);
    page.picture({left, row_at(2)}, size,
                 image_of(level,
                          [&](int t) {
                            const V3f difference = tile.fit[t] - tile.truth[t];
                            return diverging_colour(luminance(difference) / scale);
                          }),
                 "difference, " + title);
    page.text({middle, row_at(2) + size.y + 24}, fmt::format("{:.2f} dB", comparison.by_pair[shown[i]].psnr),
              17, ink, Anchor::middle, true);
    page.text({middle, row_at(2) + size.y + 42},
              fmt::format("white is {:.2g} 1/sr", static_cast<double>(white)), 12, muted, Anchor::middle);
  }

  // The scale of the differences.
  const auto columns = static_cast<double>(shown.size());
  const V2d bar(std::floor(tiles_left + columns * (room + tile_gap)) + 2, row_at(2));
  const int steps = static_cast<int>(size.y);
  Image ramp{1, steps, 3, {}};
  for (int y = 0; y < steps; ++y) {
    const V3f c = diverging_colour(1 - 2 * (y + 0.5) / steps);
    ramp.pixels.insert(ramp.pixels.end(), {c.x, c.y, c.z});
  }
  page.picture(bar, {14, size.y}, ramp, "scale of the differences");
  page.text({bar.x + 20, bar.y + 11}, fmt::format("+{:g}", scale), 12, ink);
  page.text({bar.x + 20, bar.y + size.y / 2 + 4}, "0", 12, ink);
  page.text({bar.x + 20, bar.y + size.y}, fmt::format("-{:g}", scale), 12, ink);
  page.text({bar.x + 20, bar.y + size.y + 18}, "1/sr", 12, muted);
  return row_at(2) + size.y + 42;
}

}  // namespace selvedge
