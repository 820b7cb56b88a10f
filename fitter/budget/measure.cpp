// LayerFitter::measure_errors(): the errors of all candidates of a level (candidates.h).
#include <algorithm>

#include "fitter/budget/candidates.h"
#include "format/fabric/evaluate.h"

namespace selvedge {
namespace {

/// max(0, sum over m of c_m phi_m(v) psi_m(l)) of every owner of coefficients. The products of functions are
/// computed once for all owners; with evaluate(), the choice among slabs takes three times as long. `fabric`:
/// for the grids of views and lights.
std::vector<V3f> radiance_of_owners(const BasisFit& basis, const Fabric& fabric, const DirectionPair& pair) {
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
    values.push_back(factor * colour);
  }
  std::vector<V3f> radiance;
  const float* coefficient = basis.coefficient.data();
  for (std::size_t owner = 0; owner < basis.owners(); ++owner) {
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

/// Means over the rays of each texel for direction number `direction` of `rays`. `radiance`: by entry.
std::vector<V3f> seen_by_texels(const std::vector<V3f>& radiance, const SlabRays& rays, std::size_t texels,
                                std::size_t direction, std::size_t directions) {
  const float share = 1.0F / static_cast<float>(rays.rays);
  std::vector<V3f> seen(texels, V3f(0, 0, 0));
  for (std::size_t t = 0; t < texels; ++t) {
    const std::uint32_t* entries = &rays.entries[(t * directions + direction) * rays.rays];
    for (int ray = 0; ray < rays.rays; ++ray) {
      if (entries[ray] != SlabRays::no_entry) seen[t] += share * radiance[entries[ray]];
    }
  }
  return seen;
}

}  // namespace

void LayerFitter::measure_errors(std::size_t k, const LevelTruth& truth,
                                 const std::vector<DirectionPair>& pairs) {
  Level& level = levels_[k];
  std::vector<V3f> views;
  for (const DirectionPair& pair : pairs) views.push_back(pair.view);
  std::vector<SlabRays> rays;
  for (std::size_t shape = 0; shape < level.heights.size(); ++shape) {
    rays.push_back(level.heights[shape] ? slab_rays(heights_alone(level, shape), fabric_, views)
                                        : SlabRays{});
  }
  const auto gloss_of = [&](std::size_t texel, const DirectionPair& pair) {
    const int width = level.glossy.width;
    const int t = static_cast<int>(texel);
    return evaluate(level.glossy, fabric_, t % width, t / width, pair.light, pair.view).radiance;
  };
  std::vector<V3f> gloss;  // [pair][texel]
  for (std::size_t i = 0; level.gloss && i < pairs.size() * level.glossy.texels(); ++i) {
    gloss.push_back(gloss_of(i % level.glossy.texels(), pairs[i / level.glossy.texels()]));
  }
  for (LevelCandidate& candidate : level.candidates) {
    if (!has_basis(candidate)) {
      const bool table = candidate.kind == LevelCandidate::Kind::lobes_and_table;
      candidate.error = level_error(table ? level.paper : level.plain, fabric_, pairs, truth);
      continue;
    }
    candidate.error = mean_squared_error(truth, [&](std::size_t pair) {
      std::vector<V3f> radiance = radiance_of_owners(candidate.basis, fabric_, pairs[pair]);
      const std::size_t texels = level.paper.texels();
      if (!has_slabs(candidate)) {
        const DirectionTaps at = interpolate(fabric_.views, pairs[pair].view);
        for (std::size_t t = 0; t < texels; ++t) {
          radiance[t] *= interpolated(level.paper.opacity(), t, fabric_.views.count(), at);
        }
        return radiance;
      }
      if (candidate.kind == LevelCandidate::Kind::glossy_slabs) {
        const std::size_t entries = radiance.size() / texels;
        for (std::size_t i = 0; i < radiance.size(); ++i) radiance[i] *= gloss[pair * texels + i / entries];
      }
      return seen_by_texels(radiance, rays[candidate.shape], texels, pair, pairs.size());
    });
  }
}

}  // namespace selvedge
