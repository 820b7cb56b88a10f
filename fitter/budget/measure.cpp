// LayerFitter::measure_errors(): the errors of all candidates of a level (candidates.h).
#include <algorithm>

#include "fitter/budget/candidates.h"

namespace selvedge {
namespace {

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

}  // namespace

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

}  // namespace selvedge
