#include "apps/report/compare_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "apps/report/chart.h"
#include "apps/report/compare_tiles.h"
#include "format/quality/compare.h"
#include "format/quality/fit_record.h"

namespace selvedge {
namespace {

using Anchor = Svg::Anchor;

constexpr const char* held_out_colour = vermilion;
constexpr const char* training_colour = blue;
constexpr const char* model_colour = green;
constexpr int page_width = 1400;
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

/// Training and model behind held-out, on an axis from 0.
Chart chart_of(const char* title, const char* subtitle, Series held_out, Series training, Series model,
               Axis x) {
  double highest = 0;
  for (const Series* series : {&held_out, &training, &model}) {
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
  model.colour = model_colour;
  model.line = 2;
  model.disc = 3.5;
  model.label_offset = {0, 34};
  return {title, subtitle, "", std::move(x), axis_from_zero(1.06 * highest), {training, model, held_out}};
}

/// `model`: nothing, or the comparison with the same pairs as that of `held_out`.
std::vector<Chart> charts_of(const ComparedPairs& held_out, const ComparedPairs& training,
                             const std::optional<Comparison>& model) {
  std::vector<Chart> charts;
  Axis angles{0, 90, false, {}};
  for (int angle = 0; angle <= 90; angle += bin_width)
    angles.ticks.push_back({static_cast<double>(angle), fmt::format("{}°", angle)});
  for (const auto& [title, direction] : {std::pair("Error over the angle of view", &DirectionPair::view),
                                         std::pair("Error over the angle of light", &DirectionPair::light)}) {
    Series counts;
    Series unused;
    const Series error = error_by_angle(held_out, direction, counts);
    const Series of_model = model ? error_by_angle({held_out.pairs, *model}, direction, unused) : Series{};
    charts.push_back(chart_of(title, "relative L2 error at level 0; numbers: held-out pairs", error,
                              error_by_angle(training, direction, unused), of_model, angles));
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
                            psnr_by_level(held_out.comparison), psnr_by_level(training.comparison),
                            model ? psnr_by_level(*model) : Series{}, sizes));
  return charts;
}

void draw_title(Svg& svg, const Fabric& fabric, const Comparison& held_out, const Comparison& training,
                const std::optional<Comparison>& model, const PlotNames& names) {
  const LevelComparison& base = held_out.levels.front();
  svg.text({plot_margin, 50}, file_name(names.fabric, 44), 26, ink, Anchor::start, true);
  svg.text(
      {plot_margin, 76},
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
  if (!model) return;
  legend(101, model_colour, "model", *model);
  svg.text({plot_margin, 102}, "model: " + names.model.substr(0, 96), 14, muted);
}

}  // namespace

Result<std::string> compare_plot(const Fabric& fabric, const PairSamples& held_out,
                                 const PairSamples& training, const PlotNames& names,
                                 const PairAnswers& model) {
  if (held_out.pairs.empty()) {
    return fail(Code::samples_malformed, names.samples, name_of(PairKind::held_out),
                "there are no pairs to draw");
  }
  const auto of_held_out = compare(fabric, held_out, PairKind::held_out);
  if (!of_held_out) return tl::unexpected(of_held_out.error());
  const auto of_training = compare(fabric, training, PairKind::held_out, of_held_out->peak);
  if (!of_training) return tl::unexpected(of_training.error());
  std::optional<Comparison> of_model;
  if (!model.empty()) of_model = compare_answers(model, held_out, PairKind::held_out, of_held_out->peak);
  Svg svg;
  const auto tiles_end =
      draw_tiles(svg, fabric, {held_out, *of_held_out}, {model, of_model}, of_model ? 132 : 106);
  if (!tiles_end) return tl::unexpected(tiles_end.error());
  draw_title(svg, fabric, *of_held_out, *of_training, of_model, names);
  const V2d size(360, 210);
  V2d corner(plot_margin + 40, *tiles_end + 92);
  for (const Chart& chart : charts_of({held_out, *of_held_out}, {training, *of_training}, of_model)) {
    draw_chart(svg, corner, size, chart);
    corner.x += std::round((page_width - 2 * plot_margin + 60) / 3);
  }
  const double notes = corner.y + size.y + 62;
  const auto note = [&](double y, const char* form, double value) {
    svg.text({plot_margin, y}, fmt::format(fmt::runtime(form), value), 12, muted);
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
