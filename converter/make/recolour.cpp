#include "converter/make/recolour.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "converter/bake/bake.h"
#include "converter/bake/yarn_samples.h"
#include "converter/light/light_bands.h"
#include "converter/light/recoloured_light.h"
#include "converter/make/fallback_factors.h"
#include "converter/make/pack_yarn.h"
#include "converter/mesh/map_joints.h"
#include "fitter/budget/candidates.h"
#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/samples/pool.h"

namespace selvedge {
namespace {

/// Views that are sampled: every so many of a grid, so that they lie in all rows and columns of it.
constexpr int sampled_views = 8;
constexpr int sampled_pairs = 48;
/// Roughly: pairs, and lights of which one is sampled, whose shadows take most of the time.
constexpr int sampled_roughly = 12;
constexpr int lights_of_one = 3;

/// Samples of new yarn from some views of a side, under some lights of its grid.
struct SomeViews {
  std::vector<int> views, lights;  ///< of the grids
  SampleLevel level;
};

/// Turns the directions of a side, which lie above the cloth, to the stitch.
DirectionPair directions_of(Side side, const DirectionPair& pair) {
  const bool behind = is_view_behind(side);
  return {behind != is_transmission(side) ? mirrored(pair.light) : pair.light,
          behind ? mirrored(pair.view) : pair.view};
}

SomeViews sample_some(const YarnSampler& sampler, const Fabric& side, int light_step) {
  SomeViews some;
  std::vector<V3f> lights;
  for (int l = light_step / 2; l < side.lights.count(); l += light_step) {
    const V3f light = cell_direction(side.lights, l);
    some.lights.push_back(l);
    lights.push_back(directions_of(side.side, {light, light}).light);
  }
  const int step = std::max(1, side.views.count() / sampled_views + 1);
  for (int v = step / 2; v < side.views.count(); v += step) some.views.push_back(v);
  const V2i texels = side.texels();
  SampleLevel& level = some.level;
  level = {texels.x, texels.y, static_cast<int>(some.views.size()), static_cast<int>(lights.size())};
  const std::size_t count = level.texels();
  const std::size_t views = some.views.size();
  level.alpha.resize(count * views);
  level.normal_sum.assign(count, V3f(0, 0, 0));
  level.radiance.resize(count * views * lights.size());
  parallel_for(0, level.views, [&](std::size_t v) {
    const V3f view = cell_direction(side.views, some.views[v]);
    NoiseSum noise;
    const ViewSamples seen = sampler.sample_view(directions_of(side.side, {view, view}).view, lights,
                                                 points_per_texel(texels, 0), noise);
    for (std::size_t t = 0; t < count; ++t) {
      level.alpha[t * views + v] = seen.alpha[t];
      for (std::size_t l = 0; l < lights.size(); ++l)
        level.radiance[(t * views + v) * lights.size() + l] = seen.radiance[l * count + t];
    }
  });
  return some;
}

/// Adds alpha f that a level shows of a texel over the pairs, and that it should.
void add_texel(const FabricLevel& level, const Fabric& side, int texel,
               const std::vector<DirectionPair>& pairs, const LevelTruth& truth, std::array<V3d, 2>& sums) {
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const Shading s =
        evaluate(level, side, texel % level.width, texel / level.width, pairs[p].light, pairs[p].view);
    sums[0] += V3d(s.radiance * s.alpha);
    sums[1] += truth.pairs[p][texel];
  }
}

/// Gives every texel its mean.
void scale_lobes(FabricLevel& level, const Fabric& side, const std::vector<DirectionPair>& pairs,
                 const LevelTruth& truth) {
  const auto count = static_cast<std::size_t>(parameter_count(level.lobe_count()));
  for (int t = 0; t < level.texels(); ++t) {
    std::array<V3d, 2> sums{V3d(0), V3d(0)};
    add_texel(level, side, t, pairs, truth, sums);
    const auto& [shown, wanted] = sums;
    for (int c = 0; c < 3; ++c) {
      const auto factor = static_cast<float>(shown[c] > 0 ? wanted[c] / shown[c] : 1);
      const std::span<float> lobes = level.lobes().subspan((t * 3 + c) * count, count);
      lobes[0] *= factor;
      for (std::size_t k = 1; k < count; ++k)
        if (const std::size_t n = (k + 3) / 4 * 4; k != n)
          lobes[k] *= std::pow(factor, 1 / std::max(lobes[n], 1.0F));
    }
  }
}

/// Fits the functions of the light that the products of all levels share by least squares; under lights that
/// were not sampled they change as under those about them.
void refit_light(Fabric& side, const SomeViews& some, const std::vector<SampleLevel>& samples) {
  const auto shared = shared_bases(side);
  if (!shared) return;
  const std::size_t lights = some.lights.size();
  const std::vector<V3f> all = cell_directions(side.lights);
  const auto functions = static_cast<Eigen::Index>(shared->light.size() / all.size());
  const auto values = static_cast<Eigen::Index>(3 * lights);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(functions, functions);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(functions, values);
  Eigen::MatrixXd light(functions, values);
  for (Eigen::Index k = 0; k < light.size(); ++k)
    light(k / values, k % values) = static_cast<double>(
        shared->light[k / values * all.size() + some.lights[k % values / 3]][static_cast<int>(k % 3)]);
  for (std::size_t k = 0; k < side.levels.size(); ++k) {
    const FabricLevel& level = side.levels[k];
    if (!level.has(LayerKind::products) || level.has(LayerKind::lobes)) continue;
    const double weight = 1 / std::sqrt(level.texels());
    const float* coefficient = level.coefficients().data();
    for (std::size_t i = 0; i < samples[k].alpha.size(); ++i) {
      const std::size_t texel = i / some.views.size();
      const double alpha = static_cast<double>(samples[k].alpha[i]);
      Eigen::VectorXd row = Eigen::VectorXd::Zero(functions);
      for (std::size_t m = 0; m < level.pairs.size(); ++m) {
        const auto [a, b] = std::pair(level.pairs[m].x, level.pairs[m].y);
        const int view = (a - 1) * side.views.count() + some.views[i % some.views.size()];
        row[b] += alpha * static_cast<double>(coefficient[texel * level.pairs.size() + m] *
                                              (a == 0 ? 1 : shared->view[view]));
      }
      Eigen::RowVectorXd seen(values);
      for (Eigen::Index l = 0; l < values; ++l)
        seen[l] =
            alpha * static_cast<double>(samples[k].radiance[i * lights + l / 3][static_cast<int>(l % 3)] /
                                        all[some.lights[l / 3]].z / side.radiance_scale);
      normal.noalias() += weight * row * row.transpose();
      right.noalias() += weight * row * seen;
    }
  }
  right -= normal * light;
  normal.diagonal().array() += 1e-4 * normal.trace() / static_cast<double>(functions);
  const Eigen::MatrixXd change = normal.ldlt().solve(right);
  auto bases = std::make_shared<ProductBases>(*shared);
  for (std::size_t i = 0; i < bases->light.size(); ++i) {
    V3d sum(0);
    double weights = 0;
    for (std::size_t k = 0; k < lights; ++k) {
      const double away = static_cast<double>((all[i % all.size()] - all[some.lights[k]]).length2());
      const double weight = 1 / (1e-20 + away * away);
      for (int c = 0; c < 3; ++c) sum[c] += weight * change(i / all.size(), 3 * k + c);
      weights += weight;
    }
    bases->light[i] += V3f(sum / weights);
  }
  for (FabricLevel& level : side.levels)
    if (level.bases) level.bases = bases;
}

/// Scales the products from what they show to what is wanted.
void scale_light(Fabric& side, const std::array<V3d, 2>& sums) {
  const auto shared = shared_bases(side);
  if (!shared) return;
  const auto& [shown, wanted] = sums;
  // As fine as a fit's (texel_basis()), of cloth that is as bright.
  float largest = 0;
  auto bases = std::make_shared<ProductBases>(*shared);
  for (V3f& light : bases->light) {
    for (int c = 0; c < 3; ++c) light[c] *= static_cast<float>(shown[c] > 0 ? wanted[c] / shown[c] : 1);
    largest = std::max(largest, light.length());
  }
  const float step = std::exp2(std::floor(std::log2(std::max(largest, 1e-6F)))) / 256;
  for (V3f& light : bases->light)
    for (int c = 0; c < 3; ++c) light[c] = step * std::round(light[c] / step);
  for (FabricLevel& level : side.levels)
    if (level.bases) level.bases = bases;
}

/// Gives the products the mean over a repeat, between the directions of the grids.
void match_means(Fabric& side, const std::vector<DirectionPair>& pairs, const LevelTruth& truth) {
  // The coarsest level of a map has all stitches.
  const FabricLevel& coarsest = side.levels.back();
  std::array<V3d, 2> sums{V3d(0), V3d(0)};
  for (int t = 0; t < coarsest.texels(); ++t) add_texel(coarsest, side, t, pairs, truth, sums);
  if (coarsest.has(LayerKind::products)) scale_light(side, sums);
}

void recolour_texels(Fabric& side, const YarnSampler& sampler, bool is_rough) {
  const SomeViews some = sample_some(sampler, side, is_rough ? lights_of_one : 1);
  const int pair_count = is_rough ? sampled_roughly : sampled_pairs;
  const auto pairs = random_direction_pairs(pair_count, min_pair_z, 1);
  const int points = points_per_texel(side.texels(), 0);
  const std::size_t texels = some.level.texels();
  PairSamples seen{some.level.width, some.level.height, pairs};
  seen.alpha.resize(pairs.size() * texels);
  seen.radiance.resize(pairs.size() * texels);
  parallel_for(0, pair_count, [&](std::size_t p) {
    NoiseSum noise;
    const PairSamples pair = sampler.sample_pair(directions_of(side.side, pairs[p]), points, noise);
    std::ranges::copy(pair.alpha, seen.alpha.begin() + static_cast<std::ptrdiff_t>(p * texels));
    std::ranges::copy(pair.radiance, seen.radiance.begin() + static_cast<std::ptrdiff_t>(p * texels));
  });
  const std::vector<LevelTruth> truths = level_truths(seen);
  std::vector<SampleLevel> samples{some.level};
  while (samples.size() < side.levels.size()) samples.push_back(pool(samples.back()));
  for (std::size_t k = side.levels.size(); k-- > 0;) {
    FabricLevel& level = side.levels[k];
    if (level.copied_from_coarser)
      level.copy_texels(side.levels[k + 1], 1);
    else if (level.has(LayerKind::lobes))
      scale_lobes(level, side, pairs, truths[k]);
  }
  const LevelTruth& coarsest = truths[side.levels.size() - 1];
  match_means(side, pairs, coarsest);
  refit_light(side, some, samples);
  match_means(side, pairs, coarsest);
}

}  // namespace

bool differs_only_in_colour(const Fabric& fabric, const YarnCell& cell) {
  const auto& stored = fabric.levels.front().yarns();
  const YarnData& yarns = cell.yarns;
  if (!stored || stored->data().curves.size() != yarns.curves.size() ||
      stored->data().nodes.size() != yarns.nodes.size() || stored->period() != V2f(cell.period) ||
      stored->data().map != yarns.map)
    return false;
  float tolerance = 1;
  for (std::size_t c = 0; c < yarns.curves.size(); ++c) {
    const YarnCurve& last = stored->data().curves[c];
    const YarnCurve& curve = yarns.curves[c];
    if (last.nodes != curve.nodes || last.plies.count != curve.plies.count || last.radius != curve.radius)
      return false;
    tolerance = std::min(tolerance, ply_or_yarn_radius(curve) / 64);
  }
  return std::ranges::equal(yarns.nodes, stored->data().nodes,
                            [&](const V3f& a, const V3f& b) { return a.equalWithAbsError(b, tolerance); });
}

Fabric recolour(const Fabric& fabric, const YarnCell& cell, Recolouring recolouring) {
  const bool is_rough = recolouring != Recolouring::exact;
  Fabric result = fabric;
  const bool both = fabric.find_side(Side::back) != nullptr;
  const Yarns& last = *fabric.levels.front().yarns();
  YarnData yarns = is_rough ? last.data() : cell.yarns;
  for (std::size_t c = 0; c < yarns.curves.size(); ++c) {
    yarns.curves[c].albedo = cell.yarns.curves[c].albedo;
    // Large cloth has fewer stations than its cell.
    yarns.curves[c].stations = last.data().curves[c].stations;
  }
  if (is_rough)
    recolour_light(yarns, last, cell.wall_transmission);
  else
    compute_light_in_bands(yarns, last.period(), cell.wall_transmission, {both});
  YarnData sampled = yarns;
  std::array<V3d, 2> albedos{V3d(0), V3d(0)};
  for (std::size_t c = 0; c < sampled.curves.size() && is_rough; ++c) {
    YarnCurve& curve = sampled.curves[c];
    curve.plies.divisions = 1;
    curve.hairs = {};
    albedos[0] += V3d(last.data().curves[c].albedo) * curve.stations;
    albedos[1] += V3d(curve.albedo) * curve.stations;
  }
  std::optional<YarnSampler> sampler;
  if (recolouring != Recolouring::yarn)
    sampler.emplace(std::move(sampled), cell, fabric.reference_height, fabric.texels(), both);
  const auto change = [&](Fabric& side) {
    if (sampler)
      recolour_texels(side, *sampler, is_rough);
    else
      scale_light(side, albedos);
  };
  change(result);
  for (auto& other : result.sides) {
    if (!other) continue;
    Fabric side = *other;
    change(side);
    other = std::make_shared<const Fabric>(std::move(side));
  }
  if (!is_rough) {
    if (!yarns.map.empty()) join_light(yarns, last.period());
    yarns = packed_if_large(std::move(yarns));
  }
  result.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(yarns), last.period()));
  result.accuracy = "{}";
  if (!is_rough) result.fallback = fallback_json_text(fit_fallback(result));
  return result;
}

}  // namespace selvedge
