#include "apps/report/compare_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "apps/report/chart.h"
#include "format/fabric/evaluate.h"
#include "format/quality/compare.h"
#include "format/quality/fit_record.h"

namespace selvedge {
namespace {

using Anchor = Svg::Anchor;

constexpr const char* held_out_colour = vermilion;
constexpr const char* training_colour = blue;
constexpr int page_width = 1400;
constexpr double margin = 40;
constexpr std::size_t max_tiles = 6;
constexpr double tiles_left = 160;
constexpr double tiles_right = 1300;
constexpr double gap = 14;

/// A set of pairs with its comparison.
struct ComparedPairs {
  const PairSamples& pairs;
  const Comparison& comparison;
};

/// Degrees from the normal.
double angle_of(const V3f& direction) {
  return std::acos(std::clamp(static_cast<double>(direction.z), -1.0, 1.0)) * 180 / std::numbers::pi;
}

/// Degrees around it from u, in [0, 360).
double azimuth_of(const V3f& direction) {
  const double radians = std::atan2(static_cast<double>(direction.y), static_cast<double>(direction.x));
  return std::fmod(radians * 180 / std::numbers::pi + 360, 360.0);
}

std::string angles_text(const V3f& direction) {
  return fmt::format("{:.0f}° / {:.0f}°", angle_of(direction), azimuth_of(direction));
}

std::string thousands(std::uint64_t number) {
  std::string digits = fmt::format("{}", number);
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, 1, ',');
  return digits;
}

/// The file's name of a path, cut off where there is no room for more.
std::string file_name(const std::string& path, std::size_t max_size) {
  const std::string name = path.substr(path.rfind('/') + 1);
  return name.size() <= max_size ? name : name.substr(0, max_size - 3) + "...";
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
  std::vector<V3f> fit;

  /// Of luminance (ITU-R BT.709), fit - truth.
  double difference(std::size_t texel) const {
    const V3d d = V3d(fit[texel]) - V3d(truth[texel]);
    return 0.2126 * d.x + 0.7152 * d.y + 0.0722 * d.z;
  }
  /// 99.9 % of the truth's values are below it.
  double white() const {
    std::vector<double> values;
    for (const V3f& c : truth) values.push_back(static_cast<double>(std::max({c.x, c.y, c.z})));
    return quantile(std::move(values), 0.999);
  }
};

Tile tile_of(const Fabric& fabric, const PairSamples& held_out, std::size_t pair) {
  const FabricLevel& level = fabric.levels.front();
  const DirectionPair& directions = held_out.pairs[pair];
  Tile tile;
  for (int t = 0; t < level.texels(); ++t) {
    const std::size_t from = pair * level.texels() + t;
    tile.truth.push_back(held_out.radiance[from] * held_out.alpha[from]);
    const Shading s =
        evaluate(level, fabric, t % level.width, t / level.width, directions.light, directions.view);
    tile.fit.push_back(s.radiance * s.alpha);
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

/// Truth, fit and difference side by side for some pairs; gives back where the next thing may begin.
Result<double> draw_tiles(Svg& svg, const Fabric& fabric, const ComparedPairs& held_out, double top) {
  const FabricLevel& level = fabric.levels.front();
  const std::vector<std::size_t> shown = spread_pairs(held_out.pairs.pairs, max_tiles);
  std::vector<Tile> tiles;
  std::vector<double> differences;
  for (const std::size_t pair : shown) {
    tiles.push_back(tile_of(fabric, held_out.pairs, pair));
    for (int t = 0; t < level.texels(); ++t) differences.push_back(std::abs(tiles.back().difference(t)));
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

  constexpr std::array rows{"truth", "fit", "fit - truth"};
  std::array<double, 3> y{};
  for (std::size_t row = 0; row < 3; ++row) {
    y[row] = top + 74 + static_cast<double>(row) * (size.y + gap);
    svg.text({margin, y[row] + size.y / 2 + 5}, rows[row], 15, ink, Anchor::start, true);
  }
  svg.text({margin, y[2] + size.y / 2 + 24}, "luminance", 12, muted);
  svg.text({margin, top + 14}, "Held-out pairs,", 13, ink, Anchor::start, true);
  svg.text({margin, top + 31}, "steep to flat", 13, ink, Anchor::start, true);
  svg.disc({margin + 5, top + 46}, 4.5, ink);
  svg.text({margin + 15, top + 50}, "view", 12, muted);
  draw_light(svg, {margin + 57, top + 46});
  svg.text({margin + 67, top + 50}, "light", 12, muted);
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
    for (const auto& ok :
         {draw(0, "truth", [&](int t) { return tile.truth[t] / white; }),
          draw(1, "fit", [&](int t) { return tile.fit[t] / white; }),
          draw(2, "difference", [&](int t) { return diverging_colour(tile.difference(t) / scale); })}) {
      if (!ok) return tl::unexpected(ok.error());
    }
    const V2d below(left + size.x / 2, y[2] + size.y);
    svg.text(below + V2d(0, 24), fmt::format("{:.2f} dB", held_out.comparison.by_pair[shown[i]].psnr), 17,
             ink, Anchor::middle, true);
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
  return y[2] + size.y + 42;
}

constexpr int bin_width = 15;  ///< degrees
constexpr std::size_t bins = 90 / bin_width;

/// The relative L2 error of the pairs whose direction lies within each of some ranges of angles; their
/// numbers go into `counts`, on the axis.
Series error_by_angle(const ComparedPairs& compared, V3f DirectionPair::*direction, Series& counts) {
  std::array<double, bins> squared{};
  std::array<double, bins> energy{};
  std::array<int, bins> pairs{};
  for (std::size_t p = 0; p < compared.pairs.pairs.size(); ++p) {
    const double angle = angle_of(compared.pairs.pairs[p].*direction);
    const std::size_t bin = std::min(static_cast<std::size_t>(angle / bin_width), bins - 1);
    squared[bin] += compared.comparison.by_pair[p].squared;
    energy[bin] += compared.comparison.by_pair[p].energy;
    pairs[bin] += 1;
  }
  Series series;
  for (std::size_t b = 0; b < bins; ++b) {
    const double middle = (static_cast<double>(b) + 0.5) * bin_width;
    counts.points.emplace_back(middle, 0);
    counts.labels.push_back(fmt::format("{}", pairs[b]));
    if (energy[b] > 0) series.points.emplace_back(middle, std::sqrt(squared[b] / energy[b]));
  }
  return series;
}

Series psnr_by_level(const Comparison& comparison) {
  Series series;
  for (const LevelComparison& level : comparison.levels) {
    series.points.emplace_back(static_cast<double>(series.points.size()) + 0.5, std::max(0.0, level.psnr));
    series.labels.push_back(fmt::format("{:.1f}", level.psnr));
  }
  return series;
}

/// Training behind held-out, on an axis from 0.
Chart chart_of(const char* title, const char* subtitle, Series held_out, Series training, Axis x) {
  double highest = 0;
  for (const Series* series : {&held_out, &training}) {
    for (const V2d& p : series->points) highest = std::max(highest, p.y);
  }
  held_out.colour = held_out_colour;
  training.colour = training_colour;
  held_out.line = 3;
  training.line = 2;
  held_out.disc = 4.5;
  training.disc = 3.5;
  held_out.label_offset = {0, 19};
  training.label_offset = {0, -10};
  return {title, subtitle, "", std::move(x), axis_from_zero(1.06 * highest), {training, held_out}};
}

std::vector<Chart> charts_of(const ComparedPairs& held_out, const ComparedPairs& training) {
  std::vector<Chart> charts;
  Axis angles{0, 90, false, {}};
  for (int angle = 0; angle <= 90; angle += bin_width)
    angles.ticks.push_back({static_cast<double>(angle), fmt::format("{}°", angle)});
  for (const auto& [title, direction] : {std::pair("Error over the angle of view", &DirectionPair::view),
                                         std::pair("Error over the angle of light", &DirectionPair::light)}) {
    Series counts;
    Series unused;
    const Series error = error_by_angle(held_out, direction, counts);
    charts.push_back(chart_of(title, "relative L2 error at level 0; numbers: held-out pairs", error,
                              error_by_angle(training, direction, unused), angles));
    counts.colour = muted;
    counts.label_offset = {0, -7};
    charts.back().series.push_back(counts);
  }
  const std::vector<LevelComparison>& levels = held_out.comparison.levels;
  Axis sizes{0, static_cast<double>(levels.size()), false, {}};
  for (std::size_t k = 0; k < levels.size(); ++k) {
    sizes.ticks.push_back(
        {static_cast<double>(k) + 0.5,
         levels.size() > 7 ? fmt::format("{}", k) : fmt::format("{}x{}", levels[k].width, levels[k].height)});
  }
  charts.push_back(chart_of("Error of every level", "PSNR in dB, higher is better",
                            psnr_by_level(held_out.comparison), psnr_by_level(training.comparison), sizes));
  return charts;
}

void draw_title(Svg& svg, const Fabric& fabric, const Comparison& held_out, const Comparison& training,
                const PlotNames& names) {
  const LevelComparison& base = held_out.levels.front();
  svg.text({margin, 50}, file_name(names.fabric, 44), 26, ink, Anchor::start, true);
  svg.text(
      {margin, 76},
      fmt::format("{} x {} texels, {}, {} bytes, beside the truth of {}", base.width, base.height,
                  layers_text(fabric.levels.front()), thousands(names.bytes), file_name(names.samples, 32)),
      14, muted);
  const auto legend = [&](double y, const char* colour, const char* name, const Comparison& comparison) {
    if (comparison.levels.empty()) return;
    svg.box({872, y - 11}, {14, 14}, colour);
    svg.text({894, y + 1}, name, 14, ink, Anchor::start, true);
    const LevelComparison& level = comparison.levels.front();
    svg.text({974, y + 1},
             fmt::format("{:.2f} dB, relative L2 {:.4f} at level 0, {} pairs", level.psnr, level.relative_l2,
                         comparison.pairs),
             14, ink);
  };
  legend(49, held_out_colour, "held-out", held_out);
  legend(75, training_colour, "training", training);
}

}  // namespace

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

Result<std::string> compare_plot(const Fabric& fabric, const PairSamples& held_out,
                                 const PairSamples& training, const PlotNames& names) {
  if (held_out.pairs.empty()) {
    return fail(Code::samples_malformed, names.samples, name_of(PairKind::held_out),
                "there are no pairs to draw");
  }
  const auto of_held_out = compare(fabric, held_out, PairKind::held_out);
  if (!of_held_out) return tl::unexpected(of_held_out.error());
  const auto of_training = compare(fabric, training, PairKind::held_out, of_held_out->peak);
  if (!of_training) return tl::unexpected(of_training.error());
  Svg svg;
  const auto tiles_end = draw_tiles(svg, fabric, {held_out, *of_held_out}, 106);
  if (!tiles_end) return tl::unexpected(tiles_end.error());
  draw_title(svg, fabric, *of_held_out, *of_training, names);
  const V2d size(360, 210);
  V2d corner(margin + 40, *tiles_end + 92);
  for (const Chart& chart : charts_of({held_out, *of_held_out}, {training, *of_training})) {
    draw_chart(svg, corner, size, chart);
    corner.x += std::round((page_width - 2 * margin + 60) / 3);
  }
  const double notes = corner.y + size.y + 62;
  const auto note = [&](double y, const char* form, double value) {
    svg.text({margin, y}, fmt::format(fmt::runtime(form), value), 12, muted);
  };
  note(notes,
       "Angles are from the normal / around it from u. Errors are those of opacity times reflectance over "
       "black; dB against the peak of {:.4g} 1/sr, the truth's 99.9th percentile.",
       of_held_out->peak);
  note(
      notes + 18,
      "Truth and fit of a pair have one exposure. The truth's own noise is at {:.1f} dB. Held-out pairs took "
      "no part in the fit; where training is much better, the fit knows its samples only.",
      of_held_out->levels.front().noise_psnr);
  return svg.file(
      page_width, static_cast<int>(notes + 50),
      fmt::format("{} beside the truth of {}", file_name(names.fabric, 44), file_name(names.samples, 32)));
}

}  // namespace selvedge
