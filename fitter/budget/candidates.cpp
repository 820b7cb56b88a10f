#include "fitter/budget/candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "fitter/budget/level_error.h"
#include "fitter/products/coded_size.h"
#include "fitter/products/quantise.h"
#include "fitter/solve/radiance_scale.h"
#include "format/fabric/layers.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

constexpr int max_lights = 512;
constexpr std::size_t level_view_functions = 12;
constexpr std::size_t level_light_functions = 16;
/// Quantisations to try: steps as shares of the power of two below the strongest product's scale, so that
/// multiples have few bits; and the price of a bit.
struct Coarseness {
  float step;
  float price;
};
constexpr std::array coarseness{
    Coarseness{0.25F, 0.5F},     Coarseness{0.125F, 0.2F},     Coarseness{0.125F, 0.5F},
    Coarseness{0.0625F, 0.3F},   Coarseness{0.0625F, 0.8F},    Coarseness{0.03125F, 0.5F},
    Coarseness{0.015625F, 0.3F}, Coarseness{0.0078125F, 0.3F}, Coarseness{0.00390625F, 0.3F}};
/// Thresholds to try for the root mean square of a pair's coefficients, as shares of the same power of two.
constexpr std::array min_shares{0.00390625F, 0.0078125F, 0.015625F, 0.03125F, 0.0625F, 0.125F};
/// Bytes per pair of functions in the file in addition to its coefficients.
constexpr double bytes_per_pair = 8;

double bytes_of(const FabricLevel& level, LayerKind kind) {
  return coded_bytes(level[kind].values, level[kind].channels, level.width);
}

/// Normals and tangents separately, as in the file.
double bytes_of_frame(const FabricLevel& level) {
  std::vector<float> normals;
  std::vector<float> tangents;
  for (const auto& [n, t] : level.frame()) {
    normals.insert(normals.end(), {n.x, n.y, n.z});
    tangents.insert(tangents.end(), {t.x, t.y, t.z});
  }
  return coded_bytes(normals, 3, level.width) + coded_bytes(tangents, 3, level.width);
}

/// Lobes are stored in 32 bits, whose mantissas hardly compress.
double bytes_of_lobes(const FabricLevel& level) {
  return 3.6 * static_cast<double>(level.lobes().size()) + bytes_of_frame(level);
}

/// Without the noise.
void append(PairSamples& to, const PairSamples& from) {
  to.width = from.width;
  to.height = from.height;
  to.pairs.insert(to.pairs.end(), from.pairs.begin(), from.pairs.end());
  to.alpha.insert(to.alpha.end(), from.alpha.begin(), from.alpha.end());
  to.radiance.insert(to.radiance.end(), from.radiance.begin(), from.radiance.end());
}

}  // namespace

void LayerFitter::add_quantised(std::size_t level, const BasisFit& basis, double bytes) {
  const float scale = coefficient_scale(basis);
  if (!(scale > 0)) return;
  const float unit = std::exp2(std::floor(std::log2(scale)));
  const std::size_t width = levels_[level].paper.width;
  for (const Coarseness& coarse : coarseness) {
    std::size_t last = 0;
    for (const float share : min_shares) {
      if (share < 0.25F * coarse.step || share > 2 * coarse.step) continue;
      Quantisation quantisation;
      quantisation.step = unit * coarse.step;
      quantisation.min_rms = share / coarse.step;
      quantisation.price = coarse.price;
      quantisation.width = width;
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

/// Scales the largest radiance to about 1, for sums of squares in single precision. Samples that are not
/// finite remain so, and fit() reports their place.
void LayerFitter::scale_radiance(SampleLevel& samples, PairSamples& pairs, PairSamples& measured) {
  float largest = 0;
  for (const V3f& r : samples.radiance) largest = std::max({largest, r.x, r.y, r.z});
  scale_ = choose_radiance_scale(static_cast<double>(largest));
  const auto inverse = static_cast<float>(1 / scale_);
  for (std::vector<V3f>* radiance : {&samples.radiance, &pairs.radiance, &measured.radiance}) {
    for (V3f& r : *radiance) r *= inverse;
  }
}

/// Fits the paper's model with and without view table.
Result<void> LayerFitter::fit_lobes(const SampleLevel& samples, const SamplesHeader& header,
                                    const FitOptions& options, const Progress& progress,
                                    const PairSamples& measured) {
  const auto part = [&](double from, double size) -> Progress {
    return [&progress, from, size](double share) {
      if (progress) progress(from + size * share);
    };
  };
  auto paper = fit(samples, header, options, part(0, 0.5), measured);
  if (!paper) return tl::unexpected(paper.error());
  Result<FitResult> plain = paper;
  if (options.view_table) {
    FitOptions without_table = options;
    without_table.view_table = false;
    plain = fit(samples, header, without_table, part(0.5, 0.2), measured);
    if (!plain) return tl::unexpected(plain.error());
  }
  for (Fabric* fabric : {&paper->fabric, &plain->fabric}) remove_radiance_scale(*fabric);
  for (std::size_t k = 0; k < paper->levels.size(); ++k) {
    Level& level = levels_.emplace_back();
    level.paper = std::move(paper->fabric.levels[k]);
    level.report = std::move(paper->levels[k]);
    level.plain = std::move(plain->fabric.levels[k]);
    level.plain_report = std::move(plain->levels[k]);
  }
  fabric_ = std::move(paper->fabric);
  fabric_.levels.clear();
  fabric_.lights = header.lights;
  training_ = std::move(paper->training);
  for (V3f& r : training_.radiance) r *= static_cast<float>(scale_);
  warnings_ = std::move(paper->warnings);
  return {};
}

/// Adds candidates with a basis that all levels share, and with the paper's model.
void LayerFitter::add_candidates(const std::vector<SampleLevel>& pooled, const LevelTruth& mean,
                                 const std::vector<DirectionPair>& pairs) {
  std::vector<BasisFit> basis =
      texel_basis(pooled, fabric_.lights, level_view_functions, level_light_functions);
  // Interpolation between few directions changes the mean: a hand-over from the yarn would show it.
  scale_light(basis, brightness(basis.size() - 1, basis.back(), mean, pairs));
  for (std::size_t k = 0; k < levels_.size(); ++k) {
    const FabricLevel& paper = levels_[k].paper;
    const double opacity = bytes_of(paper, LayerKind::opacity);
    add_quantised(k, basis[k], opacity);
    LevelCandidate candidate;
    candidate.kind = LevelCandidate::Kind::lobes;
    candidate.bytes = opacity + bytes_of_lobes(paper);
    levels_[k].candidates.push_back(candidate);
    if (!paper.has(LayerKind::table)) continue;
    candidate.kind = LevelCandidate::Kind::lobes_and_table;
    candidate.bytes += bytes_of(paper, LayerKind::table);
    levels_[k].candidates.push_back(candidate);
  }
}

Result<LayerFitter> LayerFitter::create(SampleLevel samples, const SamplesHeader& header,
                                        const PairSamples& validation, const FitOptions& options,
                                        const Progress& progress, PairSamples measured) {
  if (header.lights.count() > max_lights) {
    return fail(Code::option_out_of_range, {}, "budget",
                fmt::format("{} lights; layers are chosen for at most {}, and --quality paper has no limit",
                            header.lights.count(), max_lights));
  }
  if (validation.pairs.empty()) {
    return fail(Code::samples_malformed, {}, "validation",
                "there are no pairs to choose layers by; --quality paper needs none");
  }
  LayerFitter fitter;
  PairSamples pairs = validation;
  fitter.scale_radiance(samples, pairs, measured);
  if (auto ok = fitter.fit_lobes(samples, header, options, progress, measured); !ok) {
    return tl::unexpected(ok.error());
  }
  std::vector<SampleLevel> pooled{std::move(samples)};
  while (pooled.size() < fitter.levels_.size()) pooled.push_back(pool(pooled.back()));
  if (progress) progress(0.85);
  const std::vector<LevelTruth> truths = level_truths(pairs);
  const std::size_t levels = fitter.levels_.size();
  // Measured pairs count for the brightness, too: few are held out where few pictures were taken.
  append(measured, pairs);
  fitter.add_candidates(pooled, level_truths(measured)[levels - 1], measured.pairs);
  for (std::size_t k = 0; k < levels; ++k) {
    fitter.measure_errors(k, truths[k], pairs.pairs);
    if (progress) progress(0.9 + 0.1 * static_cast<double>(k + 1) / static_cast<double>(levels));
  }
  return fitter;
}

}  // namespace selvedge
