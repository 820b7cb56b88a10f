#include "fitter/budget/candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "fitter/budget/level_error.h"
#include "fitter/gloss/slab_lobes.h"
#include "fitter/slabs/coded_size.h"
#include "fitter/slabs/slab_tables.h"
#include "fitter/solve/radiance_scale.h"
#include "format/fabric/layers.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

constexpr int max_lights = 512;
/// Number of functions of the view for slabs; gloss needs those of degree 2.
constexpr int slab_view_functions = 6;
constexpr std::size_t slab_light_functions = 24;
/// Numbers of functions of the view for slabs with lobes, which already have gloss.
constexpr std::array glossy_view_functions{1, 6};
/// Lobes that leave more than this share of the error are not used.
constexpr double max_left_by_gloss = 0.95;
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
/// Smaller steps do not improve slabs, whose error is due to their cells.
constexpr float min_step_of_slabs = 0.015625F;
/// Numbers of cells along a texel's side to try, up to those of the samples.
constexpr std::array cells_tried{2, 3};
/// More coefficients in a texel than this were never chosen.
constexpr std::size_t max_coefficients = 640;
/// Levels with fewer cells along a side get no slabs.
constexpr int min_cells = 16;

/// Bytes per pair of functions in the file in addition to its coefficients.
constexpr double bytes_per_pair = 8;

/// Heights rounded to multiples of a power of two, at most 1/256 of the thickness, which half precision holds
/// exactly.
HeightLayer stored_heights(const HeightLayer& heights, float thickness) {
  const float step = std::exp2(std::floor(std::log2(std::max(thickness, 1e-30F) / 256)));
  const auto rounded = [&](std::vector<float> values) {
    for (float& value : values) value = step * std::round(value / step);
    return values;
  };
  return {heights.shape, rounded(heights.top), rounded(heights.bottom)};
}

double bytes_of(const HeightLayer& heights, std::size_t width) {
  const std::size_t entries = heights.shape.entries();
  return coded_bytes(heights.top, entries, width) + coded_bytes(heights.bottom, entries, width);
}

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

/// Lobes of few kinds of texels compress well.
double bytes_of_gloss(const FabricLevel& level) {
  const Layer& lobes = level[LayerKind::lobes];
  return coded_bytes(lobes.values, lobes.channels, level.width, false) + bytes_of_frame(level);
}

/// The shapes to try: the uppermost slab or all slabs, with few or many cells.
std::vector<SlabShape> shapes_of(const SlabShape& finest) {
  std::vector<SlabShape> shapes;
  for (const int slabs : {1, finest.slabs}) {
    for (const int cells : cells_tried) {
      const SlabShape shape{std::min(cells, finest.columns), std::min(cells, finest.rows), slabs};
      if (std::find(shapes.begin(), shapes.end(), shape) == shapes.end()) shapes.push_back(shape);
    }
  }
  return shapes;
}

}  // namespace

/// A level with the heights of a shape as its only layer.
FabricLevel LayerFitter::heights_alone(const Level& level, std::size_t shape) {
  FabricLevel result;
  result.width = level.paper.width;
  result.height = level.paper.height;
  result.set_heights(*level.heights[shape]);
  return result;
}

void LayerFitter::add_candidates(std::size_t level, const BasisFit& basis, const LevelCandidate& prototype,
                                 const SlabOverlaps* overlaps) {
  const float scale = coefficient_scale(basis);
  if (!(scale > 0)) return;
  const std::size_t texels = levels_[level].paper.texels();
  const float unit = std::exp2(std::floor(std::log2(scale)));
  const std::size_t width = levels_[level].paper.width;
  const std::size_t entries = basis.owners() / texels;
  for (const Coarseness& coarse : coarseness) {
    if (overlaps != nullptr && coarse.step < min_step_of_slabs) continue;
    std::size_t last = 0;
    for (const float share : min_shares) {
      if (share < 0.25F * coarse.step || share > 2 * coarse.step) continue;
      Quantisation quantisation;
      quantisation.step = unit * coarse.step;
      quantisation.min_rms = share / coarse.step;
      quantisation.price = coarse.price;
      quantisation.width = width;
      quantisation.entries = entries;
      const std::size_t pairs = kept_pair_count(basis, quantisation);
      if (pairs == last || std::cmp_greater(pairs, FabricLimits{}.products) ||
          pairs * entries > max_coefficients) {
        continue;
      }
      last = pairs;
      LevelCandidate candidate = prototype;
      candidate.basis = quantise(basis, quantisation, overlaps);
      candidate.bytes += coded_bytes(candidate.basis.coefficient, entries * pairs, width) +
                         bytes_per_pair * static_cast<double>(pairs);
      levels_[level].candidates.push_back(std::move(candidate));
    }
  }
}

void LayerFitter::fit_gloss(std::size_t k, const SampleLevel& samples, const SlabRays& rays,
                            std::size_t entries, const FitOptions& options) {
  if (options.slab_lobes == 0 || (k > 0 && !has_gloss_)) return;
  SlabLobeOptions lobe_options;
  lobe_options.lobes = options.slab_lobes;
  SlabLobeFit fit = fit_slab_lobes(samples, rays, entries, fabric_.views, fabric_.lights, lobe_options);
  if (k == 0) {
    has_gloss_ = options.glossy_slabs || fit.errors.back() < max_left_by_gloss * fit.errors.front();
  }
  if (!has_gloss_) return;
  // All levels have the same units, so that they share functions.
  if (k > 0) fit.gloss.unit = levels_[0].gloss->unit;
  Level& level = levels_[k];
  level.glossy.width = level.paper.width;
  level.glossy.height = level.paper.height;
  set_gloss(fit.gloss, level.glossy);
  level.gloss = std::move(fit.gloss);
}

void LayerFitter::add_slabs(std::size_t shape, const std::vector<SampleLevel>& pooled, HeightLayer heights,
                            const FitOptions& options) {
  const auto views = smooth_view_functions(fabric_.views, slab_view_functions);
  std::vector<SlabTables> tables;
  std::array<std::vector<SlabTables>, glossy_view_functions.size()> glossy;
  std::vector<SlabOverlaps> overlaps;
  for (std::size_t k = 0; k < pooled.size(); ++k) {
    const SampleLevel& samples = pooled[k];
    if (k > 0) heights = pool_heights(heights, pooled[k - 1].width, pooled[k - 1].height);
    const SlabShape& cells = heights.shape;
    if (std::min(samples.width * cells.columns, samples.height * cells.rows) < min_cells) break;
    const std::size_t entries = samples.texels() * cells.entries();
    Level& level = levels_[k];
    level.heights[shape] = stored_heights(heights, fabric_.thickness_mm);
    const SlabRays rays = slab_rays(heights_alone(level, shape), fabric_, directions_of(fabric_.views));
    tables.push_back(fit_slabs(samples, rays, entries, views));
    overlaps.push_back(overlaps_of(rays, entries));
    if (shape == 0) fit_gloss(k, samples, rays, entries, options);
    if (!level.gloss) continue;
    const SlabFactors factors = factors_of(*level.gloss, gloss_directions(fabric_.views, fabric_.lights));
    for (std::size_t i = 0; i < glossy.size(); ++i) {
      const auto functions = smooth_view_functions(fabric_.views, glossy_view_functions[i]);
      glossy[i].push_back(fit_slabs(samples, rays, entries, functions, &factors));
    }
  }
  if (tables.empty()) return;
  const auto add = [&](LevelCandidate::Kind kind, const std::vector<BasisFit>& basis) {
    for (std::size_t k = 0; k < basis.size(); ++k) {
      LevelCandidate prototype;
      prototype.kind = kind;
      prototype.shape = shape;
      prototype.bytes = bytes_of(*levels_[k].heights[shape], pooled[k].width);
      if (kind == LevelCandidate::Kind::glossy_slabs) prototype.bytes += bytes_of_gloss(levels_[k].glossy);
      add_candidates(k, basis[k], prototype, &overlaps[k]);
    }
  };
  add(LevelCandidate::Kind::slabs, slab_basis(tables, views, slab_light_functions));
  for (std::size_t i = 0; i < glossy.size(); ++i) {
    if (glossy[i].empty()) continue;
    const auto functions = smooth_view_functions(fabric_.views, glossy_view_functions[i]);
    add(LevelCandidate::Kind::glossy_slabs,
        slab_basis(glossy[i], functions, slab_light_functions, &levels_[0].gloss->unit));
  }
}

void LayerFitter::keep_glossy_slabs() {
  for (Level& level : levels_) {
    std::vector<LevelCandidate> glossy;
    for (const LevelCandidate& candidate : level.candidates) {
      if (candidate.kind == LevelCandidate::Kind::glossy_slabs) glossy.push_back(candidate);
    }
    // All levels share a shape; with shape 0 a combination of all levels exists.
    const bool in_first = std::any_of(glossy.begin(), glossy.end(),
                                      [](const LevelCandidate& candidate) { return candidate.shape == 0; });
    if (in_first) level.candidates = std::move(glossy);
  }
}

/// Scales the largest radiance to about 1, for sums of squares in single precision. Samples that are not
/// finite remain so, and fit() reports their place.
void LayerFitter::scale_radiance(SampleLevel& samples, PairSamples& pairs) {
  float largest = 0;
  for (const V3f& r : samples.radiance) largest = std::max({largest, r.x, r.y, r.z});
  scale_ = choose_radiance_scale(static_cast<double>(largest));
  const auto inverse = static_cast<float>(1 / scale_);
  for (std::vector<V3f>* radiance : {&samples.radiance, &pairs.radiance}) {
    for (V3f& r : *radiance) r *= inverse;
  }
}

/// Fits the paper's model with and without view table.
Result<void> LayerFitter::fit_lobes(const SampleLevel& samples, const SamplesHeader& header,
                                    const FitOptions& options, const Progress& progress) {
  const auto part = [&](double from, double size) -> Progress {
    return [&progress, from, size](double share) {
      if (progress) progress(from + size * share);
    };
  };
  auto paper = fit(samples, header, options, part(0, 0.5));
  if (!paper) return tl::unexpected(paper.error());
  Result<FitResult> plain = paper;
  if (options.view_table) {
    FitOptions without_table = options;
    without_table.view_table = false;
    plain = fit(samples, header, without_table, part(0.5, 0.2));
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
void LayerFitter::add_texel_candidates(const std::vector<SampleLevel>& pooled) {
  const std::vector<BasisFit> basis = texel_basis(pooled, level_view_functions, level_light_functions);
  for (std::size_t k = 0; k < levels_.size(); ++k) {
    const FabricLevel& paper = levels_[k].paper;
    LevelCandidate candidate;
    candidate.bytes = bytes_of(paper, LayerKind::opacity);
    add_candidates(k, basis[k], candidate, nullptr);
    candidate.kind = LevelCandidate::Kind::lobes;
    candidate.bytes += bytes_of_lobes(paper);
    if (paper.has(LayerKind::light)) {
      candidate.bytes += bytes_of(paper, LayerKind::light);
    }
    levels_[k].candidates.push_back(candidate);
    if (!paper.has(LayerKind::table)) continue;
    candidate.kind = LevelCandidate::Kind::lobes_and_table;
    candidate.bytes += bytes_of(paper, LayerKind::table);
    levels_[k].candidates.push_back(candidate);
  }
}

Result<LayerFitter> LayerFitter::create(SampleLevel samples, const SamplesHeader& header,
                                        const std::optional<HeightLayer>& heights,
                                        const PairSamples& validation, const FitOptions& options,
                                        const Progress& progress) {
  if (header.lights.count() > max_lights) {
    return fail(
        Code::option_out_of_range, {}, "budget",
        fmt::format("{} lights; layers are chosen for at most {}", header.lights.count(), max_lights));
  }
  if (validation.pairs.empty()) {
    return fail(Code::samples_malformed, {}, "validation", "there are no pairs to choose layers by");
  }
  LayerFitter fitter;
  PairSamples pairs = validation;
  fitter.scale_radiance(samples, pairs);
  if (auto ok = fitter.fit_lobes(samples, header, options, progress); !ok) {
    return tl::unexpected(ok.error());
  }
  std::vector<SampleLevel> pooled{std::move(samples)};
  while (pooled.size() < fitter.levels_.size()) pooled.push_back(pool(pooled.back()));
  if (heights) {
    if (std::cmp_not_equal(heights->top.size(), header.texels() * heights->shape.entries())) {
      return fail(Code::samples_malformed, {}, "slabs", "the heights are not those of the texels");
    }
    const std::vector<SlabShape> shapes = shapes_of(heights->shape);
    const V2i texels(header.width, header.height);
    fitter.shapes_ = shapes.size();
    for (Level& level : fitter.levels_) level.heights.resize(shapes.size());
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      fitter.add_slabs(i, pooled, regrid_heights(*heights, texels.x, texels.y, texels, shapes[i]), options);
    }
  }
  if (progress) progress(0.85);
  fitter.add_texel_candidates(pooled);
  if (options.glossy_slabs) fitter.keep_glossy_slabs();
  const std::vector<LevelTruth> truths = level_truths(pairs);
  const std::size_t levels = fitter.levels_.size();
  for (std::size_t k = 0; k < levels; ++k) {
    fitter.measure_errors(k, truths[k], pairs.pairs);
    if (progress) progress(0.9 + 0.1 * static_cast<double>(k + 1) / static_cast<double>(levels));
  }
  return fitter;
}

}  // namespace selvedge
