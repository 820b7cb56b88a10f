#include "apps/report/compare_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "apps/report/plot_page.h"
#include "format/quality/compare.h"
#include "format/quality/fit_record.h"

namespace selvedge {
namespace {

using Anchor = DrawnText::Anchor;

constexpr int page_width = 1400;

std::string thousands(std::uint64_t number) {
  const std::string digits = fmt::format("{}", number);
  std::string result;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) result += ',';
    result += digits[i];
  }
  return result;
}

/// The file's name of a path, cut off where there is no room for more.
std::string file_name(const std::string& path, std::size_t most) {
  const std::string name = path.substr(path.rfind('/') + 1);
  return name.size() <= most ? name : name.substr(0, most - 3) + "...";
}

void draw_title(Page& page, const Fabric& fabric, const Comparison& held_out, const Comparison& training,
                const PlotNames& names) {
  const LevelComparison& base = held_out.levels.front();
  page.text({margin, 50}, file_name(names.fabric, 44), 26, ink, Anchor::start, true);
  page.text(
      {margin, 76},
      fmt::format("{} x {} texels, {}, {} bytes, beside the truth of {}", base.width, base.height,
                  layers_text(fabric.levels.front()), thousands(names.bytes), file_name(names.samples, 32)),
      14, muted);
  const auto legend = [&](double y, Rgb colour, const char* what, const Comparison& comparison) {
    page.box({872, y - 11}, {14, 14}, colour);
    page.text({894, y + 1}, what, 14, ink, Anchor::start, true);
    const LevelComparison& level = comparison.levels.front();
    page.text({974, y + 1},
              fmt::format("{:.2f} dB, relative L2 {:.4f} at level 0, {} pairs", level.psnr, level.relative_l2,
                          comparison.pairs),
              14, ink);
  };
  legend(49, held_out_colour, "held-out", held_out);
  if (!training.levels.empty()) legend(75, training_colour, "training", training);
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
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = count == 1 ? 0 : (i * (order.size() - 1) + (count - 1) / 2) / (count - 1);
    shown.push_back(order[at]);
  }
  return shown;
}

Result<Drawing> plot(const Fabric& fabric, const PairSamples& held_out, const PairSamples& training,
                     const PlotNames& names) {
  if (held_out.pairs.empty()) {
    return fail(Code::samples_malformed, names.samples, name_of(PairKind::held_out),
                "there are no pairs to draw");
  }
  const auto of_held_out = compare(fabric, held_out, PairKind::held_out);
  if (!of_held_out) return tl::unexpected(of_held_out.error());
  const auto of_training = compare(fabric, training, PairKind::held_out, of_held_out->peak);
  if (!of_training) return tl::unexpected(of_training.error());

  Page page;
  Drawing drawing;
  const double tiles_end = draw_tiles(page, fabric, held_out, *of_held_out, 106);
  const double charts_top = tiles_end + 92;
  const V2d chart_size(360, 210);
  const double pitch = (page_width - 2 * margin + 60) / 3;
  const auto chart_at = [&](int i) { return V2d(margin + 40 + std::round(i * pitch), charts_top); };
  const ComparedPairs compared{held_out, *of_held_out};
  const ComparedPairs trained{training, *of_training};
  draw_angles(page, chart_at(0), chart_size, "Error over the angle of view", compared, trained,
              &DirectionPair::view);
  draw_angles(page, chart_at(1), chart_size, "Error over the angle of light", compared, trained,
              &DirectionPair::light);
  draw_levels(page, chart_at(2), chart_size, *of_held_out, *of_training);
  draw_title(page, fabric, *of_held_out, *of_training, names);

  const double notes = charts_top + chart_size.y + 62;
  page.text(
      {margin, notes},
      fmt::format(
          "Angles are from the normal / around it from u. Errors are those of opacity times reflectance "
          "over black; dB against the peak of {:.4g} 1/sr, the truth's 99.9th percentile.",
          of_held_out->peak),
      12, muted);
  page.text(
      {margin, notes + 18},
      fmt::format(
          "Truth and fit of a pair have one exposure. The truth's own noise is at {:.1f} dB. Held-out "
          "pairs took no part in the fit; where training is much better, the fit knows its samples only.",
          of_held_out->levels.front().noise_psnr),
      12, muted);

  drawing.width = page_width;
  drawing.height = static_cast<int>(notes + 18 + 32);
  drawing.title =
      fmt::format("{} beside the truth of {}", file_name(names.fabric, 44), file_name(names.samples, 32));
  drawing.shapes = page.take();
  return drawing;
}

}  // namespace selvedge
