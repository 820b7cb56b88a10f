#include "converter/bake/texels.h"

#include <algorithm>

#include "format/base/parallel.h"

namespace selvedge {

/// Sums over half of the rays of one texel and view.
struct TexelBaker::Gather {
  int hits = 0;
  V3d normal{0, 0, 0};
  std::vector<V3d> radiance;  ///< sum over hits: [light]
};

TexelBaker::Gather TexelBaker::sample(const V2i& texel, std::uint32_t first, std::uint32_t end,
                                      std::uint64_t seed, const V3f& view,
                                      std::span<const V3f> lights) const {
  const V3d towards(view);
  const V2d period = scene_.period();
  // Rays begin beyond the cell, because the reference plane may lie within the yarn. From behind, the cell is
  // turned over.
  const auto thickness = static_cast<double>(scene_.bounds().max.z);
  const double plane_z = view.z > 0 ? plane_z_ : thickness - plane_z_;
  const double way = (thickness - plane_z_ + period.x) / std::abs(static_cast<double>(view.z));
  Gather sum{.radiance = std::vector<V3d>(lights.size(), V3d(0, 0, 0))};
  for (std::uint32_t i = first; i < end; ++i) {
    const V2d within = sobol_point(i, seed);
    // y points up, rows of texels go down.
    const V3d on_plane((texel.x + within.x) / texels_.x * period.x,
                       (1 - (texel.y + within.y) / texels_.y) * period.y, plane_z);
    SurfacePoint point;
    if (!scene_.trace(on_plane + towards * way, -towards, point)) continue;
    ++sum.hits;
    sum.normal += V3d(scene_.vertex_normal(point));
    const YarnBrdf surface = brdf_at(scene_, point);
    for (std::size_t l = 0; l < lights.size(); ++l)
      sum.radiance[l] += direct_light(scene_, point, surface, lights[l], towards);
    PathSampler sampler(i, hash64(seed));
    tracer_.add_indirect(point, towards, lights, sampler, sum.radiance);
  }
  return sum;
}

ViewSamples TexelBaker::bake_view(const V3f& view, std::span<const V3f> lights, int samples,
                                  std::uint64_t seed, NoiseSum& noise) const {
  const std::size_t texels = texels_.x * texels_.y;
  const std::size_t n = lights.size();
  ViewSamples out{std::vector<float>(texels), std::vector<V3f>(texels, V3f(0, 0, 0)),
                  std::vector<V3f>(texels * n, V3f(0, 0, 0))};
  std::vector<NoiseSum> row_noise(texels_.y);
  const int split = samples / 2;
  // If the means of the halves differ by d, the error of their mean is d/2 for equally large halves.
  const double fraction =
      static_cast<double>(split) * (samples - split) / (static_cast<double>(samples) * samples);
  parallel_for(0, texels_.y, [&](int y) {
    for (int x = 0; x < texels_.x; ++x) {
      const auto texel = static_cast<std::size_t>(y * texels_.x + x);
      const std::uint64_t own = hash64(seed ^ hash64(texel));
      const Gather early = sample({x, y}, 0, split, own, view, lights);
      const Gather late = sample({x, y}, split, samples, own, view, lights);
      const int hits = early.hits + late.hits;
      if (hits == 0) continue;
      out.alpha[texel] = static_cast<float>(hits) / static_cast<float>(samples);
      out.normal[texel] = V3f((early.normal + late.normal) / samples);
      for (std::size_t l = 0; l < n; ++l) {
        const V3d sum = early.radiance[l] + late.radiance[l];
        out.radiance[l * texels + texel] = V3f(sum / hits);
        const V3d d = early.radiance[l] / std::max(1, split) - late.radiance[l] / (samples - split);
        row_noise[y].squared_error += d.length2() * fraction;
        row_noise[y].squared_signal += (sum / samples).length2();
      }
    }
  });
  for (const NoiseSum& sum : row_noise) noise += sum;
  return out;
}

PairSamples TexelBaker::bake_pair(const DirectionPair& pair, int samples, std::uint64_t seed,
                                  NoiseSum& noise) const {
  NoiseSum within_halves;
  const std::span<const V3f> lights(&pair.light, 1);
  const ViewSamples a = bake_view(pair.view, lights, samples / 2, seed, within_halves);
  const ViewSamples b = bake_view(pair.view, lights, samples / 2, hash64(seed), within_halves);
  PairSamples out{.width = texels_.x, .height = texels_.y, .pairs = {pair}};
  for (std::size_t t = 0; t < a.alpha.size(); ++t) {
    const V3f of_a = a.radiance[t] * a.alpha[t];
    const V3f of_b = b.radiance[t] * b.alpha[t];
    const float alpha = (a.alpha[t] + b.alpha[t]) / 2;
    out.alpha.push_back(alpha);
    out.alpha_noise.push_back((a.alpha[t] - b.alpha[t]) / 2);
    out.noise.push_back((of_a - of_b) / 2);
    out.radiance.push_back(alpha > 0 ? (of_a + of_b) / (2 * alpha) : V3f(0, 0, 0));
    noise.squared_error += static_cast<double>(out.noise[t].length2());
    noise.squared_signal += static_cast<double>((of_a + of_b).length2()) / 4;
  }
  return out;
}

}  // namespace selvedge
