#include "converter/bake/reference_height.h"

#include <algorithm>
#include <array>

#include "converter/bake/setup.h"
#include "converter/bake/texels.h"
#include "fitter/fit.h"
#include "format/base/random.h"
#include "format/quality/compare.h"

namespace selvedge {
namespace {

/// A small bake in memory.
struct SmallBake {
  SamplesHeader header;
  SampleLevel level;
  PairSamples pairs;
};

SmallBake bake_small(const CellMesh& mesh, const BakeOptions& o, const TracedCell& cell,
                     IrradianceCache* cache, double plane) {
  SmallBake small;
  small.header = samples_header(mesh, o, plane * cell.mm, cell.thickness_mm(), {});
  const RayScene& scene = cell.scene;
  const TexelBaker baker(scene, cache, o.bounces, {o.width, o.height}, plane);
  const std::vector<V3f> lights = directions_of(small.header.lights);
  const std::vector<V3f> views = directions_of(small.header.views);
  std::vector<float> indirect;
  if (cache != nullptr) indirect = cache->solve(scene, lights, o.bounces);
  const std::size_t texels = o.width * o.height;
  SampleLevel& level = small.level;
  level.width = o.width;
  level.height = o.height;
  level.views = static_cast<int>(views.size());
  level.lights = static_cast<int>(lights.size());
  level.alpha.resize(texels * views.size());
  level.normal.assign(texels, V3f(0, 0, 0));
  level.radiance.resize(texels * views.size() * lights.size());
  NoiseSum ignored;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const ViewSamples seen = baker.bake_view(views[v], {lights, indirect}, o.samples, mix(v), ignored);
    for (std::size_t t = 0; t < texels; ++t) {
      level.alpha[t * views.size() + v] = seen.alpha[t];
      level.normal[t] += seen.normal[t];
      for (std::size_t l = 0; l < lights.size(); ++l) {
        level.radiance[(t * views.size() + v) * lights.size() + l] = seen.radiance[l * texels + t];
      }
    }
  }
  const auto& pairs = small.header.pairs[index_of(PairKind::validation)];
  std::vector<V3f> pair_lights;
  for (const DirectionPair& pair : pairs) pair_lights.push_back(pair.light);
  if (cache != nullptr) indirect = cache->solve(scene, pair_lights, o.bounces);
  PairSamples& all = small.pairs;
  all.width = o.width;
  all.height = o.height;
  all.pairs = pairs;
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    const LitBy lit{{&pairs[p].light, 1}, indirect, false, pairs.size(), p};
    const PairSamples truth = baker.bake_pair(pairs[p], lit, o.truth_samples, mix(~p), ignored);
    all.alpha.insert(all.alpha.end(), truth.alpha.begin(), truth.alpha.end());
    all.alpha_noise.insert(all.alpha_noise.end(), truth.alpha_noise.begin(), truth.alpha_noise.end());
    all.radiance.insert(all.radiance.end(), truth.radiance.begin(), truth.radiance.end());
    all.noise.insert(all.noise.end(), truth.noise.begin(), truth.noise.end());
  }
  return small;
}

}  // namespace

double mean_height(const RayScene& scene) {
  constexpr int side = 64;
  const V2d period = scene.period();
  const double above = static_cast<double>(scene.bounds().max.z) + period.x;
  double sum = 0;
  int hits = 0;
  for (int i = 0; i < side * side; ++i) {
    SurfacePoint point;
    const int row = i / side;
    const V3d origin((i % side + 0.5) / side * period.x, (row + 0.5) / side * period.y, above);
    if (!scene.trace(origin, {0, 0, -1}, point) || scene.is_ground(point)) continue;
    sum += static_cast<double>(point.position.z);
    ++hits;
  }
  return hits > 0 ? sum / hits : static_cast<double>(scene.bounds().max.z);
}

Result<double> best_reference_height(const CellMesh& mesh, const std::string& name,
                                     const BakeOptions& options) {
  BakeOptions o = options;
  o.width = std::min(16, o.width);
  o.height = std::min(16, o.height);
  o.views = std::min(36, o.views);
  o.lights = std::min(36, o.lights);
  o.samples = 8;
  o.truth_samples = 16;
  o.pairs.reset();
  o.validation_pairs = 48;
  o.held_out_pairs = o.rim_pairs = 0;
  // Separate pairs: no choice may depend on the pairs that measure its result.
  o.seed = mix(options.seed);
  const auto cell = trace_cell(mesh, name, o.ground);
  if (!cell) return tl::unexpected(cell.error());
  std::optional<IrradianceCache> cache;
  if (o.indirect == IndirectLight::cached) cache = IrradianceCache::build(cell->scene, o.seed);
  const auto thickness = static_cast<double>(cell->scene.bounds().max.z);
  double best = thickness;
  double best_psnr = -1e300;
  // From the top down, so that a tie (a flat cell) gives the top, as in the paper.
  for (const double share : {1.0, 0.9, 0.8, 0.7, 0.6, 0.5}) {
    SmallBake small = bake_small(mesh, o, *cell, cache ? &*cache : nullptr, share * thickness);
    const auto fitted = fit(small.level, small.header);
    if (!fitted) return tl::unexpected(fitted.error());
    const auto comparison = compare(fitted->fabric, small.pairs, PairKind::validation);
    if (!comparison) return tl::unexpected(comparison.error());
    if (comparison->levels.front().psnr <= best_psnr) continue;
    best_psnr = comparison->levels.front().psnr;
    best = share * thickness;
  }
  return best * cell->mm;
}

}  // namespace selvedge
