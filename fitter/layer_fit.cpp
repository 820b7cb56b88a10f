#include "fitter/layer_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "fitter/coded_size.h"
#include "fitter/level_judge.h"
#include "fitter/slab_fit.h"
#include "format/fabric_layout.h"
#include "format/fit_record.h"
#include "format/pool.h"

namespace selvedge {
namespace {

constexpr int most_lights = 512;
/// Functions of the view that slabs are fitted with: gloss needs the second degree.
constexpr int slab_view_functions = 6;
constexpr std::size_t slab_light_functions = 24;
constexpr std::size_t level_view_functions = 12;
constexpr std::size_t level_light_functions = 16;
/// Steps of the coefficients that are tried, as shares of the power of two below the strongest product's
/// scale: numbers whose multiples have few bits.
constexpr std::array step_shares{0.25F,    0.1875F,    0.125F,    0.09375F,    0.0625F,   0.046875F,
                                 0.03125F, 0.0234375F, 0.015625F, 0.01171875F, 0.0078125F};
/// Products are left out whose coefficients' root mean square is below so many steps.
constexpr std::array least_steps{0.35F, 0.5F, 0.7F, 1.0F, 1.4F};
/// What a decibel at level 0 counts, one at any other level being 1: most of what is seen near is level 0.
constexpr double weight_of_level_0 = 5;
/// A level with fewer cells than this along a side is no place for slabs.
constexpr int least_cells = 16;

// What a file costs beside its values, in bytes.
constexpr double bytes_per_channel = 30;
constexpr double bytes_per_pair = 8;
constexpr double bytes_of_the_rest = 12000;

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

/// The layers of a level that a kind keeps of the paper's.
FabricLevel without_table(const FabricLevel& level) {
  FabricLevel result = level;
  result.view_table.reset();
  return result;
}

}  // namespace

void LayerFitter::add_candidates(std::size_t level, const Products& products, LevelCandidate::Kind kind,
                                 double own_bytes) {
  const float scale = scale_of(products);
  if (!(scale > 0)) return;
  const auto texels = static_cast<std::size_t>(levels_[level].paper.texels());
  const float unit = std::exp2(std::floor(std::log2(scale)));
  for (const float share : step_shares) {
    std::size_t last = 0;
    for (const float least : least_steps) {
      LevelCandidate candidate;
      candidate.kind = kind;
      candidate.products = quantised(products, unit * share, least);
      const std::size_t pairs = candidate.products.pairs.size();
      if (pairs == last || pairs > static_cast<std::size_t>(FabricLimits{}.products)) continue;
      last = pairs;
      const std::vector<float>& coefficient = candidate.products.coefficient;
      const auto width = static_cast<std::size_t>(levels_[level].paper.width);
      candidate.bytes = own_bytes + coded_bytes(coefficient, coefficient.size() / texels, width) +
                        bytes_per_pair * static_cast<double>(pairs);
      levels_[level].candidates.push_back(std::move(candidate));
    }
  }
}

Result<LayerFitter> LayerFitter::create(SampleLevel samples, const SamplesHeader& header,
                                        const std::optional<HeightLayer>& heights,
                                        const PairSamples& validation, const FitOptions& options,
                                        const Progress& progress) {
  if (header.lights.count() > most_lights) {
    return fail(
        Code::option_out_of_range, {}, "budget",
        fmt::format("{} lights; layers are chosen for at most {}", header.lights.count(), most_lights));
  }
  if (validation.pairs.empty()) {
    return fail(Code::samples_malformed, {}, "validation", "there are no pairs to choose layers by");
  }
  auto paper = fit(samples, header, options, [&](double share) {
    if (progress) progress(0.7 * share);
  });
  if (!paper) return tl::unexpected(paper.error());
  LayerFitter fitter;
  fitter.shell_ = paper->fabric;
  fitter.shell_.levels.clear();
  fitter.shell_.lights = header.lights;
  for (std::size_t k = 0; k < paper->levels.size(); ++k) {
    fitter.levels_.push_back({std::move(paper->fabric.levels[k]), paper->levels[k], {}, {}});
  }
  fitter.training_ = std::move(paper->training);
  fitter.warnings_ = std::move(paper->warnings);

  std::vector<SampleLevel> pooled{std::move(samples)};
  while (pooled.size() < fitter.levels_.size()) pooled.push_back(pool(pooled.back()));

  // Slabs, as far as they have cells enough.
  const auto views = smooth_view_functions(header.views, slab_view_functions);
  std::vector<SlabTables> tables;
  if (heights) {
    if (heights->top().size() != static_cast<std::size_t>(header.texels() * heights->shape().entries())) {
      return fail(Code::samples_malformed, {}, "slabs", "the heights are not those of the texels");
    }
    HeightLayer of_level = *heights;
    for (std::size_t k = 0; k < pooled.size(); ++k) {
      const SampleLevel& level = pooled[k];
      if (k > 0) of_level = pool_heights(of_level, pooled[k - 1].width, pooled[k - 1].height);
      const SlabShape& shape = of_level.shape();
      if (std::min(level.width * shape.columns, level.height * shape.rows) < least_cells) break;
      FabricLevel marched;
      marched.width = level.width;
      marched.height = level.height;
      marched.heights = stored_heights(of_level, header.thickness_mm);
      const SlabRays rays = slab_rays(marched, fitter.shell_, directions_of(header.views));
      tables.push_back(
          fit_slabs(level, rays, static_cast<std::size_t>(level.texels() * shape.entries()), views));
      fitter.levels_[k].heights = marched.heights;
    }
  }
  if (progress) progress(0.85);
  if (!tables.empty()) {
    const std::vector<Products> slabs = slab_products(tables, views, slab_light_functions);
    for (std::size_t k = 0; k < slabs.size(); ++k) {
      fitter.add_candidates(k, slabs[k], LevelCandidate::Kind::slabs,
                            bytes_of(*fitter.levels_[k].heights, static_cast<std::size_t>(pooled[k].width)));
    }
  }
  const std::vector<Products> products = level_products(pooled, level_view_functions, level_light_functions);
  const auto view_count = static_cast<std::size_t>(header.views.count());
  for (std::size_t k = 0; k < products.size(); ++k) {
    const FabricLevel& of = fitter.levels_[k].paper;
    const double opacity = coded_bytes(of.opacity->opacity, view_count, static_cast<std::size_t>(of.width));
    fitter.add_candidates(k, products[k], LevelCandidate::Kind::products, opacity);
    LevelCandidate lobes;
    lobes.kind = LevelCandidate::Kind::lobes;
    lobes.bytes = opacity + bytes_of_lobes(of);
    fitter.levels_[k].candidates.push_back(lobes);
    if (!of.view_table) continue;
    LevelCandidate table;
    table.kind = LevelCandidate::Kind::lobes_and_table;
    table.bytes =
        lobes.bytes + bytes_of(of.view_table->colour, view_count, static_cast<std::size_t>(of.width));
    fitter.levels_[k].candidates.push_back(table);
  }

  const std::vector<LevelTruth> truths = level_truths(validation);
  std::vector<V3f> seen_from;
  for (const DirectionPair& pair : validation.pairs) seen_from.push_back(pair.view);
  for (std::size_t k = 0; k < fitter.levels_.size(); ++k) {
    Level& level = fitter.levels_[k];
    const LevelJudge judge(truths[k], validation.pairs, fitter.shell_);
    SlabRays rays;
    if (level.heights) {
      FabricLevel marched;
      marched.width = level.paper.width;
      marched.height = level.paper.height;
      marched.heights = level.heights;
      rays = slab_rays(marched, fitter.shell_, seen_from);
    }
    for (LevelCandidate& candidate : level.candidates) {
      switch (candidate.kind) {
        case LevelCandidate::Kind::slabs:
          candidate.error = judge.error(candidate.products, rays);
          break;
        case LevelCandidate::Kind::products:
          candidate.error = judge.error(candidate.products, *level.paper.opacity);
          break;
        case LevelCandidate::Kind::lobes:
          candidate.error = judge.error(without_table(level.paper));
          break;
        case LevelCandidate::Kind::lobes_and_table:
          candidate.error = judge.error(level.paper);
          break;
      }
    }
    if (progress)
      progress(0.9 + 0.1 * static_cast<double>(k + 1) / static_cast<double>(fitter.levels_.size()));
  }
  return fitter;
}

namespace {

/// The functions that a fabric stores, each once, whichever levels use it.
class FunctionList {
 public:
  FunctionList() = default;

  /// Number of a product's functions in the list; the constant function of the view is 0.
  V2i add(const Products& products, const V2i& pair) {
    const std::vector<float>& phi = products.view[static_cast<std::size_t>(pair.x)];
    const bool constant = std::all_of(phi.begin(), phi.end(), [](float value) { return value == 1; });
    const int a = constant ? 0 : index_in(view_, phi) + 1;
    return {a, index_in(light_, products.light[static_cast<std::size_t>(pair.y)])};
  }
  double bytes() const {
    std::vector<float> values;
    for (const auto* list : {&view_, &light_}) {
      for (const auto& function : *list) values.insert(values.end(), function.begin(), function.end());
    }
    return coded_bytes(values, 1, 32);
  }
  ProductBases bases() const {
    ProductBases result;
    for (const auto& function : view_)
      result.view.insert(result.view.end(), function.begin(), function.end());
    for (const auto& function : light_) {
      for (std::size_t i = 0; i + 2 < function.size(); i += 3) {
        result.light.emplace_back(function[i], function[i + 1], function[i + 2]);
      }
    }
    return result;
  }

 private:
  static int index_in(std::vector<std::vector<float>>& list, const std::vector<float>& function) {
    const auto found = std::find(list.begin(), list.end(), function);
    const auto index = static_cast<int>(found - list.begin());
    if (found == list.end()) list.push_back(function);
    return index;
  }

  std::vector<std::vector<float>> view_;
  std::vector<std::vector<float>> light_;
};

bool has_products(const LevelCandidate& candidate) {
  return candidate.kind == LevelCandidate::Kind::slabs || candidate.kind == LevelCandidate::Kind::products;
}

}  // namespace

double LayerFitter::bytes_of_functions(const std::vector<const LevelCandidate*>& chosen) const {
  FunctionList functions;
  double channels = 0;
  double most_coefficients = 0;
  bool opacity = false;
  bool lobes = false;
  bool table = false;
  bool slabs = false;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const LevelCandidate& candidate = *chosen[k];
    opacity = opacity || candidate.kind != LevelCandidate::Kind::slabs;
    table = table || candidate.kind == LevelCandidate::Kind::lobes_and_table;
    lobes = lobes || !has_products(candidate);
    slabs = slabs || candidate.kind == LevelCandidate::Kind::slabs;
    if (!has_products(candidate)) continue;
    for (const V2i& pair : candidate.products.pairs) functions.add(candidate.products, pair);
    most_coefficients =
        std::max(most_coefficients,
                 static_cast<double>(candidate.products.coefficient.size()) / levels_[k].paper.texels());
  }
  const FabricLevel& base = levels_.front().paper;
  channels += most_coefficients;
  if (slabs) channels += 2 * levels_.front().heights->shape().entries();
  if (opacity) channels += shell_.views.count();
  if (table) channels += 3 * shell_.views.count();
  if (lobes) channels += 6 + 3 * parameter_count(base.lobes->lobes);
  return functions.bytes() + bytes_per_channel * channels + bytes_of_the_rest;
}

FabricLevel LayerFitter::level_of(std::size_t k, const LevelCandidate& candidate) const {
  const Level& level = levels_[k];
  if (candidate.kind == LevelCandidate::Kind::lobes_and_table) return level.paper;
  if (candidate.kind == LevelCandidate::Kind::lobes) return without_table(level.paper);
  FabricLevel result;
  result.width = level.paper.width;
  result.height = level.paper.height;
  if (candidate.kind == LevelCandidate::Kind::slabs) result.heights = level.heights;
  if (candidate.kind == LevelCandidate::Kind::products) result.opacity = level.paper.opacity;
  result.products = ProductLayer{result.heights ? result.heights->shape().entries() : 1,
                                 candidate.products.pairs, candidate.products.coefficient};
  // The scale is that of the lobes, a power of two.
  for (float& c : result.products->coefficient) c /= shell_.radiance_scale;
  return result;
}

LayerFit LayerFitter::choose(double bytes) const {
  // Of each level the candidate with the least log(error) + lambda * bytes.
  const auto best_at = [&](double lambda) {
    std::vector<const LevelCandidate*> chosen;
    for (const Level& level : levels_) {
      const LevelCandidate* best = nullptr;
      double least = std::numeric_limits<double>::infinity();
      const double weight = &level == &levels_.front() ? weight_of_level_0 : 1;
      for (const LevelCandidate& candidate : level.candidates) {
        const double cost = weight * std::log(std::max(candidate.error, 1e-30)) + lambda * candidate.bytes;
        if (cost >= least) continue;
        least = cost;
        best = &candidate;
      }
      chosen.push_back(best);
    }
    return chosen;
  };
  const auto size_of = [&](const std::vector<const LevelCandidate*>& chosen) {
    double sum = bytes_of_functions(chosen);
    for (const LevelCandidate* candidate : chosen) sum += candidate->bytes;
    return sum;
  };
  double low = 1e-9;  // too large a file, unless the best of all fits
  double high = 1e3;
  std::vector<const LevelCandidate*> chosen = best_at(low);
  if (size_of(chosen) > bytes) {
    chosen = best_at(high);
    for (int i = 0; i < 60; ++i) {
      const double middle = std::sqrt(low * high);
      const auto tried = best_at(middle);
      if (size_of(tried) > bytes) {
        low = middle;
      } else {
        high = middle;
        chosen = tried;
      }
    }
  }

  // What is left over goes, step by step, to the level that gains most for its bytes.
  for (bool better = true; better;) {
    better = false;
    const double left = bytes - size_of(chosen);
    double best_rate = 0;
    std::size_t best_level = 0;
    const LevelCandidate* best = nullptr;
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      const double weight = k == 0 ? weight_of_level_0 : 1;
      for (const LevelCandidate& candidate : levels_[k].candidates) {
        const double more = candidate.bytes - chosen[k]->bytes;
        const double gain = weight * std::log(chosen[k]->error / std::max(candidate.error, 1e-30));
        if (!(gain > 0) || more > left || gain / std::max(more, 1.0) <= best_rate) continue;
        auto tried = chosen;
        tried[k] = &candidate;
        if (size_of(tried) > bytes) continue;
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

  LayerFit result;
  result.fabric = shell_;
  result.bytes = size_of(chosen);
  FunctionList functions;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    FabricLevel level = level_of(k, *chosen[k]);
    if (level.products) {
      for (V2i& pair : level.products->pairs) pair = functions.add(chosen[k]->products, pair);
    }
    result.levels.push_back(
        {level.width, level.height, layers_text(level), chosen[k]->error, chosen[k]->bytes, {}});
    if (level.lobes) result.levels.back().lobes = levels_[k].report;
    result.fabric.levels.push_back(std::move(level));
  }
  const auto bases = std::make_shared<const ProductBases>(functions.bases());
  for (FabricLevel& level : result.fabric.levels) {
    if (level.products) level.bases = bases;
  }
  return result;
}

}  // namespace selvedge
