#include "converter/light/fibre_tracer.h"

#include <algorithm>
#include <cmath>

#include "converter/stitch/fibres.h"

namespace selvedge {
namespace {

/// Azimuthal roughness (beta_n): sections are not quite round. No fit was found by kind; this is the value of
/// most pictures in the literature.
constexpr double azimuthal_roughness = 0.3;

/// Russian roulette ends paths that carry less than this.
constexpr double dark = 0.1;
/// From here on paths end by chance whatever they carry.
constexpr int long_path = 512;
constexpr double max_survival = 0.99;

}  // namespace

FibreTracer::FibreTracer(const FibreScene& scene, const std::vector<Yarn>& yarns, int bounces)
    : scene_(scene), bounces_(bounces) {
  for (const Yarn& yarn : yarns) {
    const YarnKind fibre = fibre_of(yarn.fibre);
    // Gloss::roughness is root 2 times the tangent of the lobe's width.
    const double along = hair_roughness(std::atan(fibre.roughness / std::sqrt(2.0)));
    optics_.emplace_back(fibre.refraction, along, azimuthal_roughness, V3d(yarn.albedo));
  }
}

FibreTracer::Escape FibreTracer::follow(const FibrePoint& point, std::span<const V3f> lights,
                                        PathSampler& sampler, std::span<V3d> radiance,
                                        std::uint64_t& rays) const {
  FibrePoint vertex = point;
  Escape path;
  path.throughput = V3d(1, 1, 1);
  for (int depth = 0;; ++depth) {
    const HairBsdf bsdf(optics_[vertex.yarn], vertex.view.dot(vertex.along), vertex.offset);
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const V3d light(lights[l]);
      const V3d sent = bsdf.scattered(hair_direction(vertex, light));
      ++rays;
      if (scene_.occluded(FibreScene::leave(vertex, light), light)) continue;
      radiance[l] += path.throughput * sent;
    }
    if (depth == bounces_) return {};
    const V2d random = sampler.next();
    const HairDirection next = bsdf.sample(random, sampler.next());
    const double density = bsdf.density(next);
    if (!(density > 0)) return {};
    path.throughput *= bsdf.scattered(next) / density;
    const double brightest = std::max({path.throughput.x, path.throughput.y, path.throughput.z});
    const double survival = std::min(depth < long_path ? 1 : max_survival, brightest / dark);
    if (survival < 1) {
      if (!(sampler.next().x < survival)) return {};
      path.throughput /= survival;
    }
    path.direction = direction_of(vertex, next);
    ++rays;
    if (!scene_.trace(FibreScene::leave(vertex, path.direction), path.direction, vertex)) return path;
  }
}

}  // namespace selvedge
