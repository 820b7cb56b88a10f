#include "format/quality/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/json_io.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

constexpr int yarn_points = 8;

/// The truth of one pair at one level, by texel; or what a fabric shows, without noise.
struct PairImage {
  std::vector<V3d> colour;  ///< alpha * r
  std::vector<V3d> noise;   ///< of the colour
  std::vector<V3d> alpha;   ///< alpha in x, its noise in y

  void pool(const V2i& size) {
    for (auto* values : {&colour, &noise, &alpha})
      if (!values->empty()) *values = pool_image(*values, size.x, size.y);
  }
};

struct Sums {
  double squared = 0;
  double energy = 0;
  double signed_error = 0;
  double truth = 0;
  double alpha_squared = 0;
  double noise = 0;
  double alpha_noise = 0;
  double count = 0;

  void add(const Sums& o) {
    for (double Sums::*const sum : {&Sums::squared, &Sums::energy, &Sums::signed_error, &Sums::truth,
                                    &Sums::alpha_squared, &Sums::noise, &Sums::alpha_noise, &Sums::count})
      this->*sum += o.*sum;
  }
};

PairImage shown_by_level(const Fabric& fabric, int k, const DirectionPair& pair) {
  const FabricLevel& level = fabric.levels[k];
  PairImage image;
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) {
      const Shading shading = evaluate(fabric, k, x, y, pair.light, pair.view);
      image.colour.emplace_back(shading.radiance * shading.alpha);
      image.alpha.emplace_back(static_cast<double>(shading.alpha), 0.0, 0.0);
    }
  }
  return image;
}

/// The yarn: the mean over yarn_points^2 points of every texel.
PairImage shown_by_yarn(const Fabric& fabric, const V2i& size, const DirectionPair& pair) {
  const FabricLevel& base = fabric.levels.front();
  PairImage image;
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      V3d colour(0, 0, 0);
      double alpha = 0;
      for (int point = 0; point < yarn_points * yarn_points; ++point) {
        const int row = point / yarn_points;
        const V2d uv((x + (point % yarn_points + 0.5) / yarn_points) / size.x,
                     (y + (row + 0.5) / yarn_points) / size.y);
        const Shading s = base.yarns()->shade(uv, fabric.reference_height, pair.light, pair.view);
        colour += V3d(s.radiance * s.alpha);
        alpha += static_cast<double>(s.alpha);
      }
      image.colour.push_back(colour / (yarn_points * yarn_points));
      image.alpha.emplace_back(alpha / (yarn_points * yarn_points), 0.0, 0.0);
    }
  }
  return image;
}

Sums compare_images(const PairImage& shown, const PairImage& truth, const V2i& size) {
  Sums sums;
  sums.count = size.x * size.y;
  for (std::size_t i = 0; i < shown.colour.size(); ++i) {
    const V3d difference = shown.colour[i] - truth.colour[i];
    const double alpha = shown.alpha[i].x - truth.alpha[i].x;
    sums.squared += difference.length2();
    sums.energy += truth.colour[i].length2();
    sums.signed_error += difference.x + difference.y + difference.z;
    sums.truth += truth.colour[i].x + truth.colour[i].y + truth.colour[i].z;
    sums.alpha_squared += alpha * alpha;
    sums.noise += truth.noise[i].length2();
    sums.alpha_noise += truth.alpha[i].y * truth.alpha[i].y;
  }
  return sums;
}

double decibels(double peak, double mean_square) {
  // The PSNR of an exact match would be infinite; errors in single precision are below 200 dB.
  constexpr double max_psnr = 200;
  if (!(mean_square > 0)) return max_psnr;
  // The truth is black, the fabric is not.
  if (!(peak > 0)) return 0;
  return std::min(max_psnr, 10 * std::log10(peak * peak / mean_square));
}

double relative(double squared, double energy) {
  if (energy > 0) return std::sqrt(squared / energy);
  return squared > 0 ? 1 : 0;
}

/// The size of the truth and of each level that follows it, `count` in all.
std::vector<V2i> sizes_of(const PairSamples& truth, int count) {
  std::vector<V2i> sizes;
  for (int k = 0; k < count; ++k) sizes.emplace_back(level_size(truth.width, k), level_size(truth.height, k));
  return sizes;
}

double psnr_peak(const PairSamples& truth) {
  std::vector<float> values;
  values.reserve(truth.alpha.size() * 3);
  for (std::size_t i = 0; i < truth.alpha.size(); ++i) {
    const V3f colour = truth.radiance[i] * truth.alpha[i];
    values.insert(values.end(), {colour.x, colour.y, colour.z});
  }
  if (values.empty()) return 0;
  const auto at = static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  const float peak = values[at];
  if (peak > 0) return static_cast<double>(peak);
  return static_cast<double>(*std::ranges::max_element(values));
}

/// `shown(pair, k, image)` turns `image` of level k - 1 into the image of level k.
template <class Shown>
Comparison compare_levels(const PairSamples& truth, const std::vector<V2i>& sizes, double peak,
                          const Shown& shown) {
  const std::size_t texels = truth.width * truth.height;
  Comparison result;
  result.pair_count = static_cast<int>(truth.pairs.size());
  result.peak = peak > 0 ? peak : psnr_peak(truth);
  const std::size_t levels = sizes.size();
  std::vector<std::vector<Sums>> by_pair(truth.pairs.size(), std::vector<Sums>(levels));
  parallel_for(0, result.pair_count, [&](std::size_t pair) {
    PairImage image;
    PairImage answer;
    for (std::size_t i = pair * texels; i < (pair + 1) * texels; ++i) {
      image.colour.push_back(V3d(truth.radiance[i]) * static_cast<double>(truth.alpha[i]));
      image.noise.emplace_back(V3d(truth.noise[i]));
      image.alpha.emplace_back(static_cast<double>(truth.alpha[i]), static_cast<double>(truth.alpha_noise[i]),
                               0.0);
    }
    for (std::size_t k = 0; k < levels; ++k) {
      if (k > 0) image.pool(sizes[k - 1]);
      shown(pair, k, answer);
      by_pair[pair][k] = compare_images(answer, image, sizes[k]);
    }
  });
  for (std::size_t k = 0; k < levels; ++k) {
    Sums sums;
    for (const auto& pair : by_pair) sums.add(pair[k]);
    if (sums.count == 0) break;
    LevelComparison level{.level = static_cast<int>(k),
                          .width = sizes[k].x,
                          .height = sizes[k].y,
                          .psnr = decibels(result.peak, sums.squared / (3 * sums.count)),
                          .relative_l2 = relative(sums.squared, sums.energy),
                          .relative_bias = sums.truth > 0 ? sums.signed_error / sums.truth : 0,
                          .alpha_rms = std::sqrt(sums.alpha_squared / sums.count),
                          .alpha_noise_rms = std::sqrt(sums.alpha_noise / sums.count),
                          .noise_psnr = decibels(result.peak, sums.noise / (3 * sums.count))};
    result.levels.push_back(level);
  }
  return result;
}

}  // namespace

Result<Comparison> compare(const Fabric& fabric, const PairSamples& truth, PairKind kind, double peak) {
  const FabricLevel& base = fabric.levels.front();
  if (truth.width != base.width || truth.height != base.height ||
      truth.alpha.size() != truth.pairs.size() * truth.width * truth.height)
    return fail(Code::fabric_mismatch, {}, name_of(kind),
                fmt::format("the samples are not of {}x{} texels as the fabric is", base.width, base.height));
  const auto sizes = sizes_of(truth, static_cast<int>(fabric.levels.size()));
  return compare_levels(truth, sizes, peak, [&](std::size_t pair, std::size_t k, PairImage& image) {
    image = shown_by_level(fabric, static_cast<int>(k), truth.pairs[pair]);
  });
}

Comparison compare_yarn(const Fabric& fabric, const PairSamples& truth, double peak) {
  const auto sizes = sizes_of(truth, static_cast<int>(fabric.levels.size()));
  Comparison result =
      compare_levels(truth, sizes, peak, [&](std::size_t pair, std::size_t k, PairImage& image) {
        if (k > 0)
          image.pool(sizes[k - 1]);
        else
          image = shown_by_yarn(fabric, sizes[0], truth.pairs[pair]);
      });
  for (LevelComparison& level : result.levels) level.level = -1;
  return result;
}

Result<void> add_side_accuracy(const Fabric& side, const PairSamples& held_out, FitRecord& record) {
  if (held_out.pairs.empty()) return {};
  const auto comparison = compare(side, held_out, PairKind::held_out, record.peak);
  if (!comparison) return tl::unexpected(comparison.error());
  record.pair_count += comparison->pair_count;
  record.peak = comparison->peak;
  for (const LevelComparison& level : comparison->levels)
    record.psnr[index_of(side.side)].push_back(level.psnr);
  return {};
}

std::string accuracy_json(const FitRecord& record) {
  nlohmann::json text = nlohmann::json::object();
  if (record.pair_count > 0)
    text = {{"pairs", record.pair_count}, {"peak", short_number(record.peak, "{:.6g}")}};
  for (const Side side : all_sides)
    for (const double psnr : record.psnr[index_of(side)])
      text[name_of(side)].push_back(short_number(psnr, "{:.2f}"));
  return text.dump();
}

std::string layers_text(const FabricLevel& level) {
  std::string text;
  const auto join = [&](const char* between, const std::string& more) {
    text += (text.empty() ? "" : between) + more;
  };
  if (level.has(LayerKind::lobes)) {
    const int lobes = level.lobe_count();
    text = lobes == 0 ? "diffuse" : fmt::format("{} lobe{}", lobes, lobes == 1 ? "" : "s");
  }
  if (level.has(LayerKind::table)) join(" x ", "table");
  if (level.has(LayerKind::light)) join(" x ", "light table");
  if (level.has(LayerKind::products)) join(", ", fmt::format("{} products", level.pairs.size()));
  return text.empty() ? "constant" : text;
}

}  // namespace selvedge
