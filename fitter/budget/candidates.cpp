#include "fitter/budget/candidates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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
/// Functions of the view that slabs are fitted with: gloss needs the second degree.
constexpr int slab_view_functions = 6;
constexpr std::size_t slab_light_functions = 24;
/// And with lobes, which know of gloss.
constexpr std::array glossy_view_functions{1, 6};
/// Lobes that leave more of the error are not tried further.
constexpr double max_left_by_gloss = 0.95;
constexpr std::size_t level_view_functions = 12;
constexpr std::size_t level_light_functions = 16;
/// Steps of the coefficients that are tried, as shares of the power of two below the strongest product's
/// scale, numbers whose multiples have few bits; and what a bit may cost.
struct Coarseness {
  float step;
  float price;
};
constexpr std::array coarseness{
    Coarseness{0.25F, 0.5F},     Coarseness{0.125F, 0.2F},     Coarseness{0.125F, 0.5F},
    Coarseness{0.0625F, 0.3F},   Coarseness{0.0625F, 0.8F},    Coarseness{0.03125F, 0.5F},
    Coarseness{0.015625F, 0.3F}, Coarseness{0.0078125F, 0.3F}, Coarseness{0.00390625F, 0.3F}};
/// Products are left out whose coefficients' root mean square is below so much of that power of two.
constexpr std::array min_shares{0.00390625F, 0.0078125F, 0.015625F, 0.03125F, 0.0625F, 0.125F};
/// Slabs gain nothing from steps below this: their cells are what limits them.
constexpr float min_step_of_slabs = 0.015625F;
/// Cells along a texel's side that are tried, as far as the samples have them.
constexpr std::array cells_tried{2, 3};
/// More coefficients in a texel than this never pay.
constexpr std::size_t max_coefficients = 640;
/// A level with fewer cells than this along a side is no place for slabs.
constexpr int min_cells = 16;

/// What a pair of functions costs in the file beside its coefficients.
constexpr double bytes_per_pair = 8;

/// Heights as multiples of a step that half precision has exactly: 1/256 of the thickness or a little less.
HeightLayer stored_heights(const HeightLayer& heights, float thickness) {
  const float step = std::exp2(std::floor(std::log2(std::max(thickness, 1e-30F) / 256)));
  const auto rounded = [&](std::vector<float> values) {
    for (float& value : values) value = step * std::round(value / step);
    return values;
  };
  return {heights.shape(), rounded(heights.top()), rounded(heights.bottom())};
}

double bytes_of(const HeightLayer& heights, std::size_t width) {
  const auto entries = static_cast<std::size_t>(heights.shape().entries());
  return coded_bytes(heights.top(), entries, width) + coded_bytes(heights.bottom(), entries, width);
}

double bytes_of(const std::vector<V3f>& colours, std::size_t per_texel, std::size_t width) {
  std::vector<float> values;
  for (const V3f& c : colours) values.insert(values.end(), {c.x, c.y, c.z});
  return coded_bytes(values, 3 * per_texel, width);
}

/// Lobes are stored in 32 bits; their mantissas do not compress.
double bytes_of_lobes(const FabricLevel& level) {
  const auto width = static_cast<std::size_t>(level.width);
  return 3.6 * static_cast<double>(level.lobes->parameters.size()) + bytes_of(level.frame->normal, 1, width) +
         bytes_of(level.frame->tangent, 1, width);
}

/// Lobes of few kinds do compress.
double bytes_of_gloss(const FabricLevel& level) {
  const auto width = static_cast<std::size_t>(level.width);
  const auto parameters = static_cast<std::size_t>(3 * parameter_count(level.lobes->lobes));
  return coded_bytes(level.lobes->parameters, parameters, width, false) +
         bytes_of(level.frame->normal, 1, width) + bytes_of(level.frame->tangent, 1, width);
}

/// A level of these texels with nothing but heights.
FabricLevel marched(const FabricLevel& texels, const HeightLayer& heights) {
  FabricLevel result;
  result.width = texels.width;
  result.height = texels.height;
  result.heights = heights;
  return result;
}

/// The shapes to try for heights of a shape: the uppermost slab alone and all, over fewer cells and more.
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

void LayerFitter::add_candidates(std::size_t level, const Products& products, const LevelCandidate& like,
                                 const SlabOverlaps* overlaps) {
  const float scale = scale_of(products);
  if (!(scale > 0)) return;
  const auto texels = static_cast<std::size_t>(levels_[level].paper.texels());
  const float unit = std::exp2(std::floor(std::log2(scale)));
  const auto width = static_cast<std::size_t>(levels_[level].paper.width);
  const std::size_t entries = products.owners() / texels;
  for (const Coarseness& coarse : coarseness) {
    if (overlaps != nullptr && coarse.step < min_step_of_slabs) continue;
    std::size_t last = 0;
    for (const float least : min_shares) {
      if (least < 0.25F * coarse.step || least > 2 * coarse.step) continue;
      Quantisation how;
      how.step = unit * coarse.step;
      how.least = least / coarse.step;
      how.price = coarse.price;
      how.width = width;
      how.entries = entries;
      const std::size_t pairs = products_kept(products, how);
      if (pairs == last || pairs > static_cast<std::size_t>(FabricLimits{}.products) ||
          pairs * entries > max_coefficients) {
        continue;
      }
      last = pairs;
      LevelCandidate candidate = like;
      candidate.products = quantised(products, how, overlaps);
      candidate.bytes += coded_bytes(candidate.products.coefficient, entries * pairs, width) +
                         bytes_per_pair * static_cast<double>(pairs);
      levels_[level].candidates.push_back(std::move(candidate));
    }
  }
}

void LayerFitter::look_for_gloss(std::size_t k, const SampleLevel& samples, const SlabRays& rays,
                                 std::size_t entries, const FitOptions& options) {
  if (options.slab_lobes == 0 || (k > 0 && !has_gloss_)) return;
  SlabLobeOptions how;
  how.lobes = options.slab_lobes;
  SlabLobeFit fit = fit_slab_lobes(samples, rays, entries, shell_.views, shell_.lights, how);
  if (k == 0) {
    has_gloss_ = options.glossy_slabs || fit.errors.back() < max_left_by_gloss * fit.errors.front();
  }
  if (!has_gloss_) return;
  // In the same units at all levels, so that levels share functions.
  if (k > 0) fit.gloss.unit = levels_[0].gloss->unit;
  Level& level = levels_[k];
  level.glossy.width = level.paper.width;
  level.glossy.height = level.paper.height;
  set_gloss(fit.gloss, level.glossy);
  level.gloss = std::move(fit.gloss);
}

void LayerFitter::add_slabs(std::size_t shape, const std::vector<SampleLevel>& pooled,
                            const HeightLayer& heights, const SamplesHeader& header,
                            const FitOptions& options) {
  const auto views = smooth_view_functions(header.views, slab_view_functions);
  const GlossDirections directions = gloss_directions(header.views, header.lights);
  std::vector<SlabTables> tables;
  std::array<std::vector<SlabTables>, glossy_view_functions.size()> glossy;
  std::vector<SlabOverlaps> overlaps;
  const HeightLayer* of_level = &heights;
  HeightLayer coarse = heights;
  for (std::size_t k = 0; k < pooled.size(); ++k) {
    const SampleLevel& level = pooled[k];
    if (k > 0) {
      coarse = pool_heights(*of_level, pooled[k - 1].width, pooled[k - 1].height);
      of_level = &coarse;
    }
    if (std::min(level.width * coarse.shape().columns, level.height * coarse.shape().rows) < min_cells) break;
    const auto entries = static_cast<std::size_t>(level.texels() * coarse.shape().entries());
    levels_[k].heights[shape] = stored_heights(coarse, header.thickness_mm);
    const SlabRays rays =
        slab_rays(marched(levels_[k].paper, *levels_[k].heights[shape]), shell_, directions_of(header.views));
    tables.push_back(fit_slabs(level, rays, entries, views));
    overlaps.push_back(overlaps_of(rays, entries));
    if (shape == 0) look_for_gloss(k, level, rays, entries, options);
    if (!levels_[k].gloss) continue;
    const SlabFactors factors = factors_of(*levels_[k].gloss, directions);
    for (std::size_t i = 0; i < glossy.size(); ++i) {
      const auto functions = smooth_view_functions(header.views, glossy_view_functions[i]);
      glossy[i].push_back(fit_slabs(level, rays, entries, functions, &factors));
    }
  }
  if (tables.empty()) return;
  const std::vector<Products> slabs = slab_products(tables, views, slab_light_functions);
  for (std::size_t k = 0; k < slabs.size(); ++k) {
    LevelCandidate like;
    like.kind = LevelCandidate::Kind::slabs;
    like.shape = shape;
    like.bytes = bytes_of(*levels_[k].heights[shape], static_cast<std::size_t>(pooled[k].width));
    add_candidates(k, slabs[k], like, &overlaps[k]);
  }
  for (std::size_t i = 0; i < glossy.size(); ++i) {
    if (glossy[i].empty()) continue;
    const auto functions = smooth_view_functions(header.views, glossy_view_functions[i]);
    std::vector<Products> with_lobes =
        slab_products(glossy[i], functions, slab_light_functions, &levels_[0].gloss->unit);
    for (std::size_t k = 0; k < with_lobes.size(); ++k) {
      LevelCandidate like;
      like.kind = LevelCandidate::Kind::glossy_slabs;
      like.shape = shape;
      like.bytes = bytes_of(*levels_[k].heights[shape], static_cast<std::size_t>(pooled[k].width)) +
                   bytes_of_gloss(levels_[k].glossy);
      add_candidates(k, with_lobes[k], like, &overlaps[k]);
    }
  }
}

void LayerFitter::keep_glossy_slabs() {
  for (Level& level : levels_) {
    std::vector<LevelCandidate> glossy;
    for (const LevelCandidate& candidate : level.candidates) {
      if (candidate.kind == LevelCandidate::Kind::glossy_slabs) glossy.push_back(candidate);
    }
    // With the first shape at least such a fabric is whole.
    const bool in_first = std::any_of(glossy.begin(), glossy.end(),
                                      [](const LevelCandidate& candidate) { return candidate.shape == 0; });
    if (in_first) level.candidates = std::move(glossy);
  }
}

void LayerFitter::judge_candidates(std::size_t k, const LevelTruth& truth,
                                   const std::vector<DirectionPair>& pairs) {
  Level& level = levels_[k];
  const LevelError judge(truth, pairs, shell_);
  std::vector<V3f> seen_from;
  for (const DirectionPair& pair : pairs) seen_from.push_back(pair.view);
  std::vector<SlabRays> rays;
  for (const auto& heights : level.heights) {
    rays.push_back(heights ? slab_rays(marched(level.paper, *heights), shell_, seen_from) : SlabRays{});
  }
  for (LevelCandidate& candidate : level.candidates) {
    switch (candidate.kind) {
      case LevelCandidate::Kind::slabs:
        candidate.error = judge.error(candidate.products, rays[candidate.shape]);
        break;
      case LevelCandidate::Kind::glossy_slabs:
        candidate.error = judge.error(candidate.products, rays[candidate.shape], level.glossy);
        break;
      case LevelCandidate::Kind::products:
        candidate.error = judge.error(candidate.products, *level.paper.opacity);
        break;
      case LevelCandidate::Kind::lobes:
        candidate.error = judge.error(level.plain);
        break;
      case LevelCandidate::Kind::lobes_and_table:
        candidate.error = judge.error(level.paper);
        break;
    }
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
  // What follows squares radiance and sums it up in single precision. Samples that are no numbers are left as
  // they are: fit() names their place.
  float largest = 0;
  for (const V3f& r : samples.radiance) largest = std::max({largest, r.x, r.y, r.z});
  fitter.scale_ = scale_for(static_cast<double>(largest));
  const auto inverse = static_cast<float>(1 / fitter.scale_);
  PairSamples judged_by = validation;
  for (std::vector<V3f>* radiance : {&samples.radiance, &judged_by.radiance}) {
    for (V3f& r : *radiance) r *= inverse;
  }
  auto paper = fit(samples, header, options, [&](double share) {
    if (progress) progress(0.5 * share);
  });
  if (!paper) return tl::unexpected(paper.error());
  Result<FitResult> plain = paper;
  if (options.view_table) {
    FitOptions without_table = options;
    without_table.view_table = false;
    plain = fit(samples, header, without_table, [&](double share) {
      if (progress) progress(0.5 + 0.2 * share);
    });
    if (!plain) return tl::unexpected(plain.error());
  }
  for (Fabric* fabric : {&paper->fabric, &plain->fabric}) remove_radiance_scale(*fabric);
  fitter.shell_ = paper->fabric;
  fitter.shell_.levels.clear();
  fitter.shell_.lights = header.lights;
  for (std::size_t k = 0; k < paper->levels.size(); ++k) {
    Level& level = fitter.levels_.emplace_back();
    level.paper = std::move(paper->fabric.levels[k]);
    level.report = paper->levels[k];
    level.plain = std::move(plain->fabric.levels[k]);
    level.plain_report = plain->levels[k];
  }
  fitter.training_ = std::move(paper->training);
  for (V3f& r : fitter.training_.radiance) r *= static_cast<float>(fitter.scale_);
  fitter.warnings_ = std::move(paper->warnings);

  std::vector<SampleLevel> pooled{std::move(samples)};
  while (pooled.size() < fitter.levels_.size()) pooled.push_back(pool(pooled.back()));

  if (heights) {
    if (heights->top().size() != static_cast<std::size_t>(header.texels() * heights->shape().entries())) {
      return fail(Code::samples_malformed, {}, "slabs", "the heights are not those of the texels");
    }
    const std::vector<SlabShape> shapes = shapes_of(heights->shape());
    fitter.shapes_ = shapes.size();
    for (Level& level : fitter.levels_) level.heights.resize(shapes.size());
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const V2i texels(header.width, header.height);
      fitter.add_slabs(i, pooled, regrid_heights(*heights, texels.x, texels.y, texels, shapes[i]), header,
                       options);
    }
  }
  if (progress) progress(0.85);
  const std::vector<Products> products = level_products(pooled, level_view_functions, level_light_functions);
  const auto view_count = static_cast<std::size_t>(header.views.count());
  for (std::size_t k = 0; k < products.size(); ++k) {
    const FabricLevel& of = fitter.levels_[k].paper;
    const double opacity = coded_bytes(of.opacity->opacity, view_count, static_cast<std::size_t>(of.width));
    LevelCandidate like;
    like.bytes = opacity;
    fitter.add_candidates(k, products[k], like, nullptr);
    LevelCandidate lobes;
    lobes.kind = LevelCandidate::Kind::lobes;
    lobes.bytes = opacity + bytes_of_lobes(of);
    if (of.light_table) {
      lobes.bytes += bytes_of(of.light_table->value, static_cast<std::size_t>(header.lights.count()),
                              static_cast<std::size_t>(of.width));
    }
    fitter.levels_[k].candidates.push_back(lobes);
    if (!of.view_table) continue;
    LevelCandidate table;
    table.kind = LevelCandidate::Kind::lobes_and_table;
    table.bytes =
        lobes.bytes + bytes_of(of.view_table->colour, view_count, static_cast<std::size_t>(of.width));
    fitter.levels_[k].candidates.push_back(table);
  }

  if (options.glossy_slabs) fitter.keep_glossy_slabs();
  const std::vector<LevelTruth> truths = level_truths(judged_by);
  for (std::size_t k = 0; k < fitter.levels_.size(); ++k) {
    fitter.judge_candidates(k, truths[k], judged_by.pairs);
    if (progress)
      progress(0.9 + 0.1 * static_cast<double>(k + 1) / static_cast<double>(fitter.levels_.size()));
  }
  return fitter;
}

}  // namespace selvedge
