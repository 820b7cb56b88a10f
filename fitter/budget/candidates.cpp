#include "fitter/budget/candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>
#include <utility>

#include "fitter/products/coded_size.h"
#include "fitter/products/quantise.h"
#include "fitter/solve/radiance_scale.h"
#include "format/base/atomic_file.h"
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
  V2i add(const BasisFit& basis, const V2i& pair);
  /// Estimated size in the file.
  double bytes() const;
  ProductBases bases() const;

 private:
  std::vector<std::vector<float>> view_;
  std::vector<std::vector<float>> light_;
};

namespace {

int index_in(std::vector<std::vector<float>>& list, const std::vector<float>& function) {
  const auto found = std::ranges::find(list, function);
  const auto index = static_cast<int>(found - list.begin());
  if (found == list.end()) list.push_back(function);
  return index;
}

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

/// Weight of log(error) at level 0, which near views show; 1 at the other levels.
constexpr double weight_of_level_0 = 5;
/// Bytes per channel in the file in addition to its values.
constexpr double bytes_per_channel = 30;

double weight_of(std::size_t level) { return level == 0 ? weight_of_level_0 : 1; }

bool has_basis(const LevelCandidate& candidate) { return candidate.kind == LevelCandidate::Kind::basis; }

/// Few pairs say little about the mean, and a large difference is no error of interpolation.
constexpr std::size_t min_pairs = 16;
constexpr double max_brightness = 1.25;

/// l_z max(0, sum over m of c_m phi_m(v) psi_m(l)) of every texel. The products of functions are computed
/// once for all texels; with evaluate(), the choice takes three times as long. `fabric`: for the grids of
/// views and lights.
std::vector<V3f> radiance_of_texels(const BasisFit& basis, const Fabric& fabric, const DirectionPair& pair) {
  const DirectionTaps views = interpolate(fabric.views, pair.view);
  const DirectionTaps lights = interpolate(fabric.lights, pair.light);
  std::vector<V3f> values;  // phi_m(v) psi_m(l)
  for (const V2i& functions : basis.pairs) {
    const std::vector<float>& phi = basis.view[functions.x];
    const std::vector<float>& psi = basis.light[functions.y];
    float factor = 0;
    V3f colour(0, 0, 0);
    for (std::size_t tap = 0; tap < 4; ++tap) {
      factor += views.weight[tap] * phi[views.cell[tap]];
      const float* rgb = &psi[3 * lights.cell[tap]];
      colour += lights.weight[tap] * V3f(rgb[0], rgb[1], rgb[2]);
    }
    values.push_back(pair.light.z * factor * colour);
  }
  std::vector<V3f> radiance;
  const float* coefficient = basis.coefficient.data();
  for (std::size_t t = 0; t < basis.texels(); ++t) {
    V3f sum(0, 0, 0);
    for (const V3f& value : values) sum += *coefficient++ * value;
    for (int c = 0; c < 3; ++c) sum[c] = std::max(sum[c], 0.0F);
    radiance.push_back(sum);
  }
  return radiance;
}

float interpolated(std::span<const float> opacity, std::size_t texel, std::size_t views,
                   const DirectionTaps& at) {
  float alpha = 0;
  for (std::size_t tap = 0; tap < 4; ++tap) {
    alpha += at.weight[tap] * opacity[texel * views + at.cell[tap]];
  }
  return alpha;
}

/// Size of the file of a fabric, without its yarn. Throws Failure.
double file_size(const Fabric& fabric, const FabricWriteOptions& options) {
  std::error_code error;
  const auto path = std::filesystem::temp_directory_path(error) / "selvedge-size.fabric.exr";
  const AtomicFile file = value_or_throw(AtomicFile::create(path.string()));
  value_or_throw(write_fabric(file.temporary(), fabric, options));
  return static_cast<double>(std::filesystem::file_size(file.temporary(), error));
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

V2i BasisList::add(const BasisFit& basis, const V2i& pair) {
  const std::vector<float>& phi = basis.view[pair.x];
  const bool constant = std::ranges::all_of(phi, [](float value) { return value == 1; });
  const int a = constant ? 0 : index_in(view_, phi) + 1;
  return {a, index_in(light_, basis.light[pair.y])};
}

double BasisList::bytes() const {
  std::vector<float> values;
  for (const auto* list : {&view_, &light_}) {
    for (const auto& function : *list) values.insert(values.end(), function.begin(), function.end());
  }
  return coded_bytes(values, 1, 32);
}

ProductBases BasisList::bases() const {
  ProductBases result;
  for (const auto& function : view_) result.view.insert(result.view.end(), function.begin(), function.end());
  for (const auto& function : light_) {
    for (std::size_t i = 0; i + 2 < function.size(); i += 3) {
      result.light.emplace_back(function[i], function[i + 1], function[i + 2]);
    }
  }
  return result;
}

std::vector<LevelTruth> level_truths(const PairSamples& truth) {
  std::vector<LevelTruth> levels(1);
  levels[0].width = truth.width;
  levels[0].height = truth.height;
  const std::size_t texels = truth.width * truth.height;
  for (std::size_t p = 0; p < truth.pairs.size(); ++p) {
    std::vector<V3d> image;
    for (std::size_t i = p * texels; i < (p + 1) * texels; ++i) {
      image.push_back(V3d(truth.radiance[i]) * static_cast<double>(truth.alpha[i]));
    }
    levels[0].pairs.push_back(std::move(image));
  }
  while (levels.back().width > 1 || levels.back().height > 1) {
    LevelTruth coarse;
    coarse.width = level_size(levels.back().width, 1);
    coarse.height = level_size(levels.back().height, 1);
    for (const auto& image : levels.back().pairs) {
      coarse.pairs.push_back(pool_image(image, levels.back().width, levels.back().height));
    }
    levels.push_back(std::move(coarse));
  }
  return levels;
}

double mean_squared_error(const LevelTruth& truth,
                          const std::function<std::vector<V3f>(std::size_t pair)>& image) {
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
  const std::size_t width = levels_[level].paper.width;
  for (const Coarseness& coarse : coarseness) {
    std::size_t last = 0;
    for (const float fraction : min_fractions) {
      if (fraction < 0.25F * coarse.step || fraction > 2 * coarse.step) continue;
      Quantisation quantisation;
      quantisation.step = unit * coarse.step;
      quantisation.min_rms = fraction / coarse.step;
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

/// Scales the largest radiance to about 1, for sums of squares in single precision.
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
void LayerFitter::fit_lobes(const SampleLevel& samples, const SamplesHeader& header,
                            const FitOptions& options, const Progress& progress,
                            const PairSamples& measured) {
  const auto part = [&](double from, double size) -> Progress {
    return [&progress, from, size](double fraction) {
      if (progress) progress(from + size * fraction);
    };
  };
  FitResult paper = value_or_throw(fit(samples, header, options, part(0, 0.5), measured));
  FitResult plain = paper;
  if (options.view_table) {
    FitOptions without_table = options;
    without_table.view_table = false;
    plain = value_or_throw(fit(samples, header, without_table, part(0.5, 0.2), measured));
  }
  for (Fabric* fabric : {&paper.fabric, &plain.fabric}) remove_radiance_scale(*fabric);
  for (std::size_t k = 0; k < paper.levels.size(); ++k) {
    Level& level = levels_.emplace_back();
    level.paper = std::move(paper.fabric.levels[k]);
    level.report = paper.levels[k];
    level.plain = std::move(plain.fabric.levels[k]);
    level.plain_report = plain.levels[k];
  }
  fabric_ = std::move(paper.fabric);
  fabric_.levels.clear();
  fabric_.lights = header.lights;
  warnings_ = std::move(paper.warnings);
}

std::vector<V3f> LayerFitter::shown(std::size_t k, const BasisFit& basis, const DirectionPair& pair) const {
  std::vector<V3f> radiance = radiance_of_texels(basis, fabric_, pair);
  const DirectionTaps at = interpolate(fabric_.views, pair.view);
  for (std::size_t t = 0; t < radiance.size(); ++t) {
    radiance[t] *= interpolated(levels_[k].paper.opacity(), t, fabric_.views.count(), at);
  }
  return radiance;
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
  for (int c = 0; c < 3; ++c) {
    if (seen[c] > 0 && modelled[c] > 0)
      ratio[c] = std::clamp(seen[c] / modelled[c], 1 / max_brightness, max_brightness);
  }
  return ratio;
}

void LayerFitter::measure_errors(std::size_t k, const LevelTruth& truth,
                                 const std::vector<DirectionPair>& pairs) {
  Level& level = levels_[k];
  for (LevelCandidate& candidate : level.candidates) {
    if (candidate.kind != LevelCandidate::Kind::basis) {
      const bool table = candidate.kind == LevelCandidate::Kind::lobes_and_table;
      candidate.error = level_error(table ? level.paper : level.plain, fabric_, pairs, truth);
      continue;
    }
    candidate.error =
        mean_squared_error(truth, [&](std::size_t pair) { return shown(k, candidate.basis, pairs[pair]); });
  }
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
  const auto ok = result_of([&] { fitter.fit_lobes(samples, header, options, progress, measured); });
  if (!ok) return tl::unexpected(ok.error());
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

double LayerFitter::bytes_of_bases(const Chosen& chosen) const {
  BasisList functions;
  std::size_t products = 0;
  bool lobes = false;
  bool table = false;
  for (const LevelCandidate* candidate : chosen) {
    table = table || candidate->kind == LevelCandidate::Kind::lobes_and_table;
    lobes = lobes || !has_basis(*candidate);
    if (!has_basis(*candidate)) continue;
    for (const V2i& pair : candidate->basis.pairs) functions.add(candidate->basis, pair);
    products = std::max(products, candidate->basis.pairs.size());
  }
  const FabricLevel& base = levels_.front().paper;
  double channels = static_cast<double>(products) + fabric_.views.count();  // and opacity
  if (table) channels += 3 * fabric_.views.count();
  if (lobes) channels += 6 + 3 * parameter_count(base.lobe_count());
  return functions.bytes() + bytes_per_channel * channels;
}

FabricLevel LayerFitter::level_of(std::size_t k, const LevelCandidate& candidate,
                                  BasisList& functions) const {
  const Level& level = levels_[k];
  if (candidate.kind == LevelCandidate::Kind::lobes_and_table) return level.paper;
  if (candidate.kind == LevelCandidate::Kind::lobes) return level.plain;
  FabricLevel result;
  result.width = level.paper.width;
  result.height = level.paper.height;
  result.set(LayerKind::opacity, level.paper[LayerKind::opacity]);
  result.pairs = candidate.basis.pairs;
  result.set(LayerKind::products, {static_cast<int>(result.pairs.size()), candidate.basis.coefficient});
  for (V2i& pair : result.pairs) pair = functions.add(candidate.basis, pair);
  return result;
}

double LayerFitter::size_of(const Chosen& chosen, double overhead) const {
  double sum = overhead + bytes_of_bases(chosen);
  for (const LevelCandidate* candidate : chosen) sum += candidate->bytes;
  return sum;
}

double LayerFitter::cost_of(const Chosen& chosen) const {
  double sum = 0;
  for (std::size_t k = 0; k < chosen.size(); ++k)
    sum += weight_of(k) * std::log(std::max(chosen[k]->error, 1e-30));
  return sum;
}

LayerFitter::Chosen LayerFitter::best(bool lobes_alone, double bytes, double overhead) const {
  const auto allowed = [&](const LevelCandidate& candidate) { return !lobes_alone || !has_basis(candidate); };
  // For each level the candidate with the smallest log(error) + lambda * bytes.
  const auto best_at = [&](double lambda) {
    Chosen chosen;
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      const LevelCandidate* best = nullptr;
      double min_cost = std::numeric_limits<double>::infinity();
      for (const LevelCandidate& candidate : levels_[k].candidates) {
        const double cost =
            weight_of(k) * std::log(std::max(candidate.error, 1e-30)) + lambda * candidate.bytes;
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
  if (size_of(chosen, overhead) > bytes) {
    chosen = best_at(high);
    for (int i = 0; i < 60; ++i) {
      const double middle = std::sqrt(low * high);
      const Chosen tried = best_at(middle);
      if (size_of(tried, overhead) > bytes) {
        low = middle;
      } else {
        high = middle;
        chosen = tried;
      }
    }
  }

  // Spends the remaining bytes, step by step, on the candidate with the largest gain per byte.
  for (bool better = true; better;) {
    better = false;
    const double left = bytes - size_of(chosen, overhead);
    double best_rate = 0;
    std::size_t best_level = 0;
    const LevelCandidate* best = nullptr;
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      for (const LevelCandidate& candidate : levels_[k].candidates) {
        const double more = candidate.bytes - chosen[k]->bytes;
        const double gain = weight_of(k) * std::log(chosen[k]->error / std::max(candidate.error, 1e-30));
        if (!(gain > 0) || more > left || gain / std::max(more, 1.0) <= best_rate || !allowed(candidate)) {
          continue;
        }
        Chosen tried = chosen;
        tried[k] = &candidate;
        if (size_of(tried, overhead) > bytes) continue;
        best_rate = gain / std::max(more, 1.0);
        best_level = k;
        best = &candidate;
      }
    }
    if (best != nullptr) {
      chosen[best_level] = best;
      better = true;
    }
  }
  return chosen;
}

LayerFit LayerFitter::choose(double bytes, double overhead) const {
  Chosen chosen = best(false, bytes, overhead);
  const Chosen lobes = best(true, bytes, overhead);
  const bool fits = size_of(chosen, overhead) <= bytes;
  const bool lobes_fit = size_of(lobes, overhead) <= bytes;
  const bool better = fits ? lobes_fit && cost_of(lobes) < cost_of(chosen)
                           : size_of(lobes, overhead) < size_of(chosen, overhead);
  if (better) chosen = lobes;

  LayerFit result;
  result.fabric = fabric_;
  result.bytes = size_of(chosen, overhead);
  BasisList functions;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    FabricLevel level = level_of(k, *chosen[k], functions);
    LevelReport report{level.width, level.height};
    if (!has_basis(*chosen[k]))
      report = level.has(LayerKind::table) ? levels_[k].report : levels_[k].plain_report;
    result.levels.push_back(report);
    result.errors.push_back(std::sqrt(chosen[k]->error) * scale_);
    result.fabric.levels.push_back(std::move(level));
  }
  const auto bases = std::make_shared<const ProductBases>(functions.bases());
  for (FabricLevel& level : result.fabric.levels) {
    if (level.has(LayerKind::products)) level.bases = bases;
  }
  set_radiance_scale(result.fabric);
  result.fabric.radiance_scale *= static_cast<float>(scale_);
  return result;
}

Result<LayerFit> LayerFitter::choose_for_file(double budget, const FabricWriteOptions& options) const {
  constexpr int max_tries = 6;
  // For the record of the fit, whose errors are not known yet.
  const double record = 90 + 210.0 * static_cast<double>(levels_.size());
  double overhead = typical_overhead;
  double smallest = std::numeric_limits<double>::infinity();
  LayerFit best;
  double best_size = 0;
  for (int i = 0; i < max_tries; ++i) {
    LayerFit chosen = choose(budget, overhead);
    const auto written = result_of([&] { return file_size(chosen.fabric, options); });
    if (!written) return tl::unexpected(written.error());
    const double size = *written + record;
    smallest = std::min(smallest, size);
    // If the file is too large, the correction has a small margin.
    const double correction = size - chosen.bytes + (size > budget ? 0.002 * budget : 0);
    if (size <= budget && size > best_size) {
      best_size = size;
      best = std::move(chosen);
    }
    if (best_size > 0.98 * budget || correction == 0) break;
    overhead += correction;
  }
  if (best_size > 0) return best;
  return fail(Code::option_out_of_range, {}, "--budget",
              fmt::format("{:.0f} bytes; the smallest fabric found has {:.0f}", budget, smallest));
}

}  // namespace selvedge
