#include "fitter/budget/candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

#include "fitter/products/quantise.h"
#include "fitter/solve/radiance_scale.h"
#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/fabric/layers.h"
#include "format/samples/pool.h"

namespace selvedge {

/// The list of shared functions that a fabric stores, without duplicates.
class BasisList {
 public:
  /// Indices in the list of the functions of a pair of `basis`, which are added if they are new; the constant
  /// function of the view has index 0.
  V2i add(const BasisFit& basis, const V2i& pair) {
    const std::vector<float>& phi = basis.view_functions[pair.x];
    const bool constant = std::ranges::all_of(phi, [](float value) { return value == 1; });
    const int a = constant ? 0 : index_in(view_, phi) + 1;
    return {a, index_in(light_, basis.light_functions[pair.y])};
  }
  /// Estimated size in the file.
  double bytes() const {
    std::vector<float> values;
    for (const auto* list : {&view_, &light_})
      for (const auto& function : *list) values.insert(values.end(), function.begin(), function.end());
    return coded_bytes(values, 1, 32);
  }
  ProductBases bases() const {
    ProductBases result;
    for (const auto& function : view_)
      result.view.insert(result.view.end(), function.begin(), function.end());
    for (const auto& function : light_)
      for (std::size_t i = 0; i + 2 < function.size(); i += 3)
        result.light.emplace_back(function[i], function[i + 1], function[i + 2]);
    return result;
  }

 private:
  static int index_in(std::vector<std::vector<float>>& list, const std::vector<float>& function) {
    const auto found = std::ranges::find(list, function);
    const auto index = static_cast<int>(found - list.begin());
    if (found == list.end()) list.push_back(function);
    return index;
  }

  std::vector<std::vector<float>> view_;
  std::vector<std::vector<float>> light_;
};

namespace {

constexpr int max_lights = 512;
constexpr std::size_t level_view_functions = 12;
constexpr std::size_t level_light_functions = 16;
/// Quantisations to try: steps as fractions of the power of two below the strongest product's scale, so that
/// multiples have few bits; and the price of a bit.
struct Coarseness {
  float step;
  float price;
};
constexpr std::array coarseness{
    Coarseness{0.25F, 0.5F},     Coarseness{0.125F, 0.2F},     Coarseness{0.125F, 0.5F},
    Coarseness{0.0625F, 0.3F},   Coarseness{0.0625F, 0.8F},    Coarseness{0.03125F, 0.5F},
    Coarseness{0.015625F, 0.3F}, Coarseness{0.0078125F, 0.3F}, Coarseness{0.00390625F, 0.3F}};
/// Thresholds to try for the root mean square of a pair's coefficients, as fractions of the same power of
/// two.
constexpr std::array min_fractions{0.00390625F, 0.0078125F, 0.015625F, 0.03125F, 0.0625F, 0.125F};
/// Bytes per pair of functions in the file in addition to its coefficients.
constexpr double bytes_per_pair = 8;

double bytes_of(const FabricLevel& level, LayerKind kind) {
  return coded_bytes(level[kind].values, level[kind].channels, level.width);
}

/// With opacity. Lobes are stored in 32 bits, whose mantissas hardly compress.
double bytes_of_lobes(const FabricLevel& level) {
  return bytes_of(level, LayerKind::opacity) + 3.6 * static_cast<double>(level.lobes().size()) +
         bytes_of(level, LayerKind::frame);
}

/// Weight of log(error) at level 0, which near views show; 1 at the other levels.
constexpr double weight_of_level_0 = 5;
/// Bytes per channel in the file in addition to its values.
constexpr double bytes_per_channel = 30;

/// How much larger the error of lobes that are worth their search may be at two texels of a level, and bytes
/// that products may take more: within a budget these cost less than such an error.
constexpr double max_error_ratio = 1.5;
constexpr double max_bytes_more = 256;

double weighted_log_error(std::size_t level, const LevelCandidate& candidate) {
  return (level == 0 ? weight_of_level_0 : 1) * std::log(std::max(candidate.error, 1e-30));
}

bool has_lobes(const LevelCandidate& candidate) { return candidate.lobes.has(LayerKind::lobes); }

/// Few pairs say little about the mean, and a large difference is no error of interpolation.
constexpr std::size_t min_pairs = 16;
constexpr double max_brightness = 1.25;

/// Sizes, frames and opacity of the paper's fit, with lobes and tables that are not searched.
std::array<ChannelFit, 3> dark_texel(const TexelSamples& samples, const FitOptions& options) {
  ChannelFit fit;
  fit.parameters.assign(parameter_count(options.lobes), 0);
  fit.table.assign(samples.view_count, 1);
  return {fit, fit, fit};
}

/// A fit to compare with others; the searches left out gain few per cent.
std::array<ChannelFit, 3> quick_texel(const TexelSamples& samples, FitOptions options) {
  options.starts = options.finalists = 1;
  options.tolerance = 0.01;
  return fit_texel(samples, options);
}

/// A level of one of the texels.
SampleLevel texel_of(const SampleLevel& level, std::size_t texel) {
  const auto part = [&](const auto& values) {
    const auto size = static_cast<std::ptrdiff_t>(values.size() / level.texels());
    const auto first = values.begin() + size * static_cast<std::ptrdiff_t>(texel);
    return std::vector(first, first + size);
  };
  return {1, 1, level.views, level.lights, part(level.alpha), part(level.normal_sum), part(level.radiance)};
}

/// Mean over pairs, texels and channels. `image` returns alpha f of every texel for a pair.
template <class ImageOfPair>
double mean_squared_error(const LevelTruth& truth, const ImageOfPair& image) {
  const std::size_t pairs = truth.pairs.size();
  std::vector<double> sums(pairs, 0);
  parallel_for(0, static_cast<int>(pairs), [&](std::size_t pair) {
    const std::vector<V3f> shown = image(pair);
    for (std::size_t t = 0; t < shown.size(); ++t)
      sums[pair] += (V3d(shown[t]) - truth.pairs[pair][t]).length2();
  });
  const double texels = truth.width * truth.height;
  const double sum = std::accumulate(sums.begin(), sums.end(), 0.0);
  return pairs > 0 ? sum / (3 * texels * static_cast<double>(pairs)) : 0;
}

}  // namespace

std::vector<LevelTruth> level_truths(const PairSamples& truth) {
  std::vector<LevelTruth> levels{{truth.width, truth.height, {}}};
  const std::size_t texels = truth.width * truth.height;
  for (std::size_t p = 0; p < truth.pairs.size(); ++p) {
    std::vector<V3d> image;
    for (std::size_t i = p * texels; i < (p + 1) * texels; ++i)
      image.push_back(V3d(truth.radiance[i]) * static_cast<double>(truth.alpha[i]));
    levels[0].pairs.push_back(std::move(image));
  }
  while (levels.back().width > 1 || levels.back().height > 1) {
    const LevelTruth& fine = levels.back();
    LevelTruth coarse{level_size(fine.width, 1), level_size(fine.height, 1), {}};
    for (const auto& image : fine.pairs) coarse.pairs.push_back(pool_image(image, fine.width, fine.height));
    levels.push_back(std::move(coarse));
  }
  return levels;
}

double level_error(const FabricLevel& level, const Fabric& fabric, const std::vector<DirectionPair>& pairs,
                   const LevelTruth& truth) {
  return mean_squared_error(truth, [&](std::size_t pair) {
    std::vector<V3f> shown;
    for (int t = 0; t < level.texels(); ++t) {
      const Shading s =
          evaluate(level, fabric, t % level.width, t / level.width, pairs[pair].light, pairs[pair].view);
      shown.push_back(s.radiance * s.alpha);
    }
    return shown;
  });
}

void LayerFitter::add_quantised(std::size_t level, const BasisFit& basis, double bytes) {
  const float scale = coefficient_scale(basis);
  if (!(scale > 0)) return;
  const float unit = std::exp2(std::floor(std::log2(scale)));
  const std::size_t width = levels_[level].dark.width;
  for (const Coarseness& coarse : coarseness) {
    std::size_t last = 0;
    for (const float fraction : min_fractions) {
      if (fraction < 0.25F * coarse.step || fraction > 2 * coarse.step) continue;
      Quantisation quantisation{.step = unit * coarse.step,
                                .min_rms = fraction / coarse.step,
                                .bit_cost = coarse.price,
                                .row_texels = width};
      const std::size_t pairs = kept_pair_count(basis, quantisation);
      if (pairs == last || std::cmp_greater(pairs, FabricLimits{}.products)) continue;
      last = pairs;
      LevelCandidate candidate;
      candidate.basis = quantise(basis, quantisation);
      candidate.bytes = bytes + coded_bytes(candidate.basis.coefficient, pairs, width) +
                        bytes_per_pair * static_cast<double>(pairs);
      levels_[level].candidates.push_back(std::move(candidate));
    }
  }
}

/// Adds the paper's model with and without view table, from level `first` on.
void LayerFitter::add_lobes(std::size_t first, const SampleLevel& samples, SamplesHeader header,
                            FitOptions options, const Progress& progress, const PairSamples& measured,
                            const PairSamples& pairs, const std::vector<LevelTruth>& truths) {
  header.width = samples.width;
  header.height = samples.height;
  const int kinds = options.view_table ? 2 : 1;
  for (int kind = 0; kind < kinds; ++kind) {
    options.view_table = kind == 1;
    const auto part = [&](double fraction) {
      if (progress) progress(0.2 + 0.8 * (kind + fraction) / kinds);
    };
    Fabric fitted = value_or_throw(fit(samples, header, options, part, measured));
    remove_radiance_scale(fitted);
    for (std::size_t k = first; k < levels_.size(); ++k) {
      LevelCandidate candidate;
      candidate.lobes = std::move(fitted.levels[k - first]);
      candidate.bytes = bytes_of_lobes(candidate.lobes) + bytes_of(candidate.lobes, LayerKind::table);
      candidate.error = level_error(candidate.lobes, fabric_, pairs.pairs, truths[k]);
      levels_[k].candidates.push_back(std::move(candidate));
    }
  }
}

/// The products of functions are computed once for all texels; with evaluate(), the choice takes three times
/// as long.
std::vector<V3f> LayerFitter::shown(std::size_t k, const BasisFit& basis, const DirectionPair& pair) const {
  const DirectionTaps views = interpolate(fabric_.views, pair.view);
  const DirectionTaps lights = interpolate(fabric_.lights, pair.light);
  std::vector<V3f> values;  // phi_m(v) psi_m(l)
  for (const V2i& functions : basis.pairs) {
    const std::vector<float>& psi = basis.light_functions[functions.y];
    V3f colour(0, 0, 0);
    for (std::size_t tap = 0; tap < 4; ++tap) {
      const float* rgb = &psi[3 * lights.cell[tap]];
      colour += lights.weight[tap] * V3f(rgb[0], rgb[1], rgb[2]);
    }
    values.push_back(pair.light.z * views.interpolated(basis.view_functions[functions.x].data()) * colour);
  }
  std::vector<V3f> result;
  // Several texels at a time, because each sum waits for its last term.
  constexpr std::size_t lanes = 8;
  for (std::size_t first = 0; first < basis.texel_count(); first += lanes) {
    std::array<const float*, lanes> coefficient{};
    for (std::size_t i = 0; i < lanes; ++i)
      coefficient[i] = &basis.coefficient[std::min(first + i, basis.texel_count() - 1) * values.size()];
    std::array<std::array<float, lanes>, 3> sum{};
    for (std::size_t m = 0; m < values.size(); ++m)
      for (std::size_t i = 0; i < lanes; ++i)
        for (int c = 0; c < 3; ++c) sum[c][i] += coefficient[i][m] * values[m][c];
    for (std::size_t i = 0; i < lanes && first + i < basis.texel_count(); ++i) {
      const V3f radiance(std::max(sum[0][i], 0.0F), std::max(sum[1][i], 0.0F), std::max(sum[2][i], 0.0F));
      const float* opacity = &levels_[k].dark.opacity()[(first + i) * fabric_.views.count()];
      result.push_back(radiance * views.interpolated(opacity));
    }
  }
  return result;
}

V3d LayerFitter::brightness(std::size_t k, const BasisFit& basis, const LevelTruth& truth,
                            const std::vector<DirectionPair>& pairs) const {
  V3d seen(0, 0, 0);
  V3d modelled(0, 0, 0);
  for (std::size_t pair = 0; pair < pairs.size(); ++pair) {
    for (const V3d& radiance : truth.pairs[pair]) seen += radiance;
    for (const V3f& radiance : shown(k, basis, pairs[pair])) modelled += V3d(radiance);
  }
  V3d ratio(1, 1, 1);
  if (pairs.size() < min_pairs) return ratio;
  for (int c = 0; c < 3; ++c)
    if (seen[c] > 0 && modelled[c] > 0)
      ratio[c] = std::clamp(seen[c] / modelled[c], 1 / max_brightness, max_brightness);
  return ratio;
}

/// Adds lobes that are not searched, with a low estimate of their error, unless products of about their bytes
/// show some of the texels better.
void LayerFitter::add_estimate(std::size_t k, const SampleLevel& samples, SamplesHeader header,
                               FitOptions options, const PairSamples& pairs, const LevelTruth& truth) {
  LevelCandidate lobes;
  lobes.lobes = levels_[k].dark;
  lobes.bytes = bytes_of_lobes(lobes.lobes);
  const LevelCandidate* rival = nullptr;
  for (const LevelCandidate& candidate : levels_[k].candidates) {
    if (candidate.bytes > lobes.bytes + max_bytes_more) continue;
    if (rival == nullptr || candidate.error < rival->error) rival = &candidate;
  }
  header.width = header.height = 1;
  double of_products = 0;
  std::array<double, 2> of_lobes{};
  std::vector<std::pair<double, std::size_t>> texels;  // by brightness
  for (std::size_t t = 0; t < truth.pairs[0].size(); ++t) {
    texels.emplace_back(0, t);
    for (const auto& image : truth.pairs) texels.back().first -= image[t].length2();
  }
  std::ranges::sort(texels);
  std::set<std::size_t> probes;
  if (rival != nullptr) probes = {texels[texels.size() / 4].second, texels[texels.size() / 2].second};
  std::vector<std::vector<V3f>> images;
  for (std::size_t p = 0; p < pairs.pairs.size() && rival != nullptr; ++p)
    images.push_back(shown(k, rival->basis, pairs.pairs[p]));
  for (const std::size_t texel : probes) {
    LevelTruth seen{1, 1, {}};
    for (const auto& image : truth.pairs) seen.pairs.push_back({image[texel]});
    of_products +=
        mean_squared_error(seen, [&](std::size_t pair) { return std::vector{images[pair][texel]}; });
    for (const bool table : {false, true}) {
      options.view_table = table;
      Fabric quick = value_or_throw(fit(texel_of(samples, texel), header, options, {}, {}, quick_texel));
      remove_radiance_scale(quick);
      of_lobes[table ? 1 : 0] += level_error(quick.levels[0], fabric_, pairs.pairs, seen);
    }
  }
  const double error = std::min(of_lobes[0], of_lobes[1]) / max_error_ratio;
  if (error > of_products) return;
  if (of_products > 0) lobes.error = rival->error * error / of_products;
  levels_[k].candidates.push_back(std::move(lobes));
}

/// Adds candidates with a basis that all levels share.
void LayerFitter::add_products(const std::vector<SampleLevel>& pooled, const PairSamples& measured,
                               const PairSamples& pairs, const std::vector<LevelTruth>& truths) {
  std::vector<BasisFit> basis =
      texel_basis(pooled, fabric_.lights, level_view_functions, level_light_functions);
  // Interpolation between few directions changes the mean: a hand-over from the yarn would show it. Measured
  // pairs count, too: few are held out where few pictures were taken.
  std::vector<DirectionPair> directions = measured.pairs;
  directions.insert(directions.end(), pairs.pairs.begin(), pairs.pairs.end());
  LevelTruth mean = level_truths(measured).back();
  mean.pairs.insert(mean.pairs.end(), truths.back().pairs.begin(), truths.back().pairs.end());
  scale_light(basis, brightness(basis.size() - 1, basis.back(), mean, directions));
  for (std::size_t k = 0; k < levels_.size(); ++k) {
    add_quantised(k, basis[k], bytes_of(levels_[k].dark, LayerKind::opacity));
    for (LevelCandidate& candidate : levels_[k].candidates)
      candidate.error = mean_squared_error(
          truths[k], [&](std::size_t pair) { return shown(k, candidate.basis, pairs.pairs[pair]); });
  }
}

Result<LayerFitter> LayerFitter::create(SampleLevel samples, const SamplesHeader& header,
                                        const PairSamples& validation, const FitOptions& options,
                                        const Progress& progress, PairSamples measured, double room) {
  if (header.lights.count() > max_lights)
    return fail(Code::option_out_of_range, {}, "budget",
                fmt::format("{} lights; layers are chosen for at most {}, and --quality paper has no limit",
                            header.lights.count(), max_lights));
  if (validation.pairs.empty())
    return fail(Code::samples_malformed, {}, "validation",
                "there are no pairs to choose layers by; --quality paper needs none");
  LayerFitter fitter;
  const auto ok = catch_failure([&] {
    PairSamples pairs = validation;
    // The largest radiance is about 1, for sums of squares in single precision.
    float largest = 0;
    for (const V3f& r : samples.radiance) largest = std::max({largest, r.x, r.y, r.z});
    fitter.scale_ = choose_radiance_scale(static_cast<double>(largest));
    const auto inverse = static_cast<float>(1 / fitter.scale_);
    for (std::vector<V3f>* radiance : {&samples.radiance, &pairs.radiance, &measured.radiance})
      for (V3f& r : *radiance) r *= inverse;
    Fabric dark = value_or_throw(fit(samples, header, options, {}, {}, dark_texel));
    for (FabricLevel& level : dark.levels) fitter.levels_.push_back({std::move(level), {}});
    fitter.fabric_ = std::move(dark);
    fitter.fabric_.levels.clear();
    fitter.fabric_.lights = header.lights;
    std::vector<SampleLevel> pooled{std::move(samples)};
    const std::size_t levels = fitter.levels_.size();
    while (pooled.size() < levels) pooled.push_back(pool(pooled.back()));
    const std::vector<LevelTruth> truths = level_truths(pairs);
    fitter.add_products(pooled, measured, pairs, truths);
    if (progress) progress(0.2);
    // Lobes are fitted to measured pairs, and products are not, so that nothing is known beforehand.
    std::size_t first = 0;
    if (options.has_map) {
      fitter.levels_.resize(1);
      first = levels;
    } else if (measured.pairs.empty()) {
      Chosen chosen;
      for (std::size_t k = 0; k < levels; ++k) {
        fitter.add_estimate(k, pooled[k], header, options, pairs, truths[k]);
        chosen.push_back(&fitter.levels_[k].candidates.back());
      }
      if (std::isfinite(room)) chosen = fitter.best(room);
      while (first < levels && !has_lobes(*chosen[first])) ++first;
      for (Level& level : fitter.levels_) std::erase_if(level.candidates, has_lobes);
      fitter.sizes_.clear();
    }
    if (first < levels)
      fitter.add_lobes(first, pooled[first], header, options, progress, measured, pairs, truths);
    if (progress) progress(1);
  });
  if (!ok) return tl::unexpected(ok.error());
  return fitter;
}

double LayerFitter::size_of(const Chosen& chosen) const {
  const auto [found, added] = sizes_.emplace(chosen, 0);
  if (!added) return found->second;
  BasisList functions;
  std::size_t products = 0;
  std::size_t lobes = 0;
  std::size_t table = 0;
  for (const LevelCandidate* candidate : chosen) {
    const FabricLevel& level = candidate->lobes;
    if (level.has(LayerKind::lobes)) lobes = 6 + level[LayerKind::lobes].channels;
    if (level.has(LayerKind::table)) table = level[LayerKind::table].channels;
    for (const V2i& pair : candidate->basis.pairs) functions.add(candidate->basis, pair);
    products = std::max(products, candidate->basis.pairs.size());
  }
  const double channels = static_cast<double>(products + lobes + table) + fabric_.views.count();  // opacity
  double sum = functions.bytes() + bytes_per_channel * channels;
  for (const LevelCandidate* candidate : chosen) sum += candidate->bytes;
  return found->second = sum;
}

double LayerFitter::cost_of(const Chosen& chosen) const {
  double sum = 0;
  for (std::size_t k = 0; k < chosen.size(); ++k) sum += weighted_log_error(k, *chosen[k]);
  return sum;
}

LayerFitter::Chosen LayerFitter::best_of(bool lobes_alone, double room) const {
  const auto allowed = [&](const LevelCandidate& candidate) { return !lobes_alone || has_lobes(candidate); };
  // For each level the candidate with the smallest log(error) + lambda * bytes.
  const auto best_at = [&](double lambda) {
    Chosen chosen;
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      const LevelCandidate* best = nullptr;
      double min_cost = std::numeric_limits<double>::infinity();
      for (const LevelCandidate& candidate : levels_[k].candidates) {
        const double cost = weighted_log_error(k, candidate) + lambda * candidate.bytes;
        if (cost >= min_cost || !allowed(candidate)) continue;
        min_cost = cost;
        best = &candidate;
      }
      chosen.push_back(best);
    }
    return chosen;
  };
  double low = 1e-9;  // gives too large a file, unless the best candidates fit
  double high = 1e3;
  Chosen chosen = best_at(low);
  if (size_of(chosen) > room) {
    chosen = best_at(high);
    for (int i = 0; i < 60; ++i) {
      const double middle = std::sqrt(low * high);
      const Chosen tried = best_at(middle);
      if (size_of(tried) > room) {
        low = middle;
      } else {
        high = middle;
        chosen = tried;
      }
    }
  }

  // Spends the remaining bytes, step by step, on the candidate with the largest gain per byte.
  for (Chosen next = chosen;; chosen = next) {
    const double left = room - size_of(chosen);
    double best_rate = 0;
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      for (const LevelCandidate& candidate : levels_[k].candidates) {
        const double more = candidate.bytes - chosen[k]->bytes;
        const double gain = weighted_log_error(k, *chosen[k]) - weighted_log_error(k, candidate);
        const double rate = gain / std::max(more, 1.0);
        if (!(gain > 0) || more > left || rate <= best_rate || !allowed(candidate)) continue;
        Chosen tried = chosen;
        tried[k] = &candidate;
        if (size_of(tried) > room) continue;
        best_rate = rate;
        next = std::move(tried);
      }
    }
    if (best_rate == 0) return chosen;
  }
}

LayerFitter::Chosen LayerFitter::best(double room) const {
  Chosen chosen = best_of(false, room);
  for (const Level& level : levels_)
    if (std::ranges::none_of(level.candidates, has_lobes)) return chosen;
  Chosen lobes = best_of(true, room);
  const bool fits = size_of(chosen) <= room;
  const bool lobes_fit = size_of(lobes) <= room;
  const bool better = fits ? lobes_fit && cost_of(lobes) < cost_of(chosen) : size_of(lobes) < size_of(chosen);
  return better ? lobes : chosen;
}

LayerFit LayerFitter::choose_within(double room) const {
  const Chosen chosen = best(room);
  LayerFit result;
  result.fabric = fabric_;
  result.bytes = size_of(chosen);
  BasisList functions;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const FabricLevel& dark = levels_[k].dark;
    const BasisFit& basis = chosen[k]->basis;
    FabricLevel level = chosen[k]->lobes;
    if (!has_lobes(*chosen[k])) {
      level.width = dark.width;
      level.height = dark.height;
      level.set_layer(LayerKind::opacity, dark[LayerKind::opacity]);
      level.set_layer(LayerKind::products, {static_cast<int>(basis.pairs.size()), basis.coefficient});
      for (const V2i& pair : basis.pairs) level.pairs.push_back(functions.add(basis, pair));
    }
    result.errors.push_back(std::sqrt(chosen[k]->error) * scale_);
    result.fabric.levels.push_back(std::move(level));
  }
  const auto bases = std::make_shared<const ProductBases>(functions.bases());
  for (FabricLevel& level : result.fabric.levels)
    if (level.has(LayerKind::products)) level.bases = bases;
  set_radiance_scale(result.fabric);
  result.fabric.radiance_scale *= static_cast<float>(scale_);
  return result;
}

}  // namespace selvedge
