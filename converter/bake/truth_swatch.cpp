#include "converter/bake/truth_swatch.h"

#include <chrono>
#include <numbers>
#include <span>
#include <vector>

#include "converter/bake/setup.h"
#include "converter/bake/truth_pixels.h"
#include "converter/light/irradiance_cache.h"
#include "converter/light/yarn_brdf.h"

namespace selvedge {
namespace {

/// Of random numbers, beside the pixels' numbers.
constexpr std::uint64_t stream_truth_cache = 103;

class SwatchTracer {
 public:
  /// `plane`: height of z = 0 in units of the scene, which are `metres` long.
  SwatchTracer(const RayScene& scene, const IrradianceCache* cache, const SwatchShot& shot,
               const TruthOptions& options, double plane, double metres)
      : scene_(scene),
        cache_(cache),
        tracer_(scene, options.bounces),
        shot_(shot),
        options_(options),
        cell_{scene.period(), metres, plane, static_cast<double>(scene.bounds().max.z)},
        choice_(shot.lights) {
    for (const Light& light : shot.lights) {
      lights_.emplace_back(light.direction.normalized());
      irradiance_.emplace_back(light.irradiance);
    }
  }

  void solve(IrradianceCache& cache) {
    irradiance_of_points_ = cache.solve(scene_, lights_, options_.bounces);
  }

  /// Adds one ray of a pixel, and returns how many that took.
  std::uint64_t trace(const SwatchRay& ray, PathSampler& sampler, PathLights& lights, PixelSum& sum) const {
    std::uint64_t rays = 1;
    SurfacePoint point;
    if (!scene_.trace(ray_origin(ray, shot_.camera, cell_), -ray.view, point) || scene_.is_ground(point)) {
      return rays;
    }
    sum.hits += 1;
    choice_.choose(sampler, lights);
    rays += light_directly(point, ray.view, lights.directions, lights.radiance);
    if (cache_ == nullptr) {
      rays += tracer_.add_indirect(point, ray.view, lights.directions, sampler, lights.radiance);
    } else {
      sum.radiance += indirect_light(point);
    }
    lights.add_to(sum);
    return rays;
  }

 private:
  std::uint64_t light_directly(const SurfacePoint& point, const V3d& view, std::span<const V3f> lights,
                               std::span<V3d> radiance) const {
    const YarnBrdf surface = surface_at(scene_, point);
    std::uint64_t rays = 0;
    for (std::size_t l = 0; l < lights.size(); ++l) {
      radiance[l] += direct_light(scene_, point, surface, lights[l], view, rays);
    }
    return rays;
  }

  V3d irradiance_at(const std::array<int, 3>& points, const CacheTaps& taps) const {
    V3d sum(0, 0, 0);
    const std::size_t n = lights_.size();
    for (std::size_t k = 0; k < 3; ++k) {
      const float* row = &irradiance_of_points_[points[k] * 3 * n];
      for (std::size_t l = 0; l < n; ++l) {
        sum += irradiance_[l] * V3d(V3f(row[l], row[n + l], row[2 * n + l])) *
               static_cast<double>(taps.weight[k]);
      }
    }
    return sum;
  }

  V3d indirect_light(const SurfacePoint& point) const {
    CacheTaps taps;
    if (!cache_->taps(point, taps)) return V3d(0, 0, 0);
    const DiffuseShares shares = diffuse_shares(scene_, point);
    const V3d sum = V3d(shares.back) * std::numbers::inv_pi * irradiance_at(taps.point, taps);
    if (!scene_.is_translucent()) return sum;
    return sum + V3d(shares.through) * std::numbers::inv_pi * irradiance_at(taps.other_side, taps);
  }

  const RayScene& scene_;
  const IrradianceCache* cache_;
  PathTracer tracer_;
  const SwatchShot& shot_;
  const TruthOptions& options_;
  SwatchCell cell_;
  LightChoice choice_;
  std::vector<V3f> lights_;
  std::vector<V3d> irradiance_;
  std::vector<float> irradiance_of_points_;  ///< the result of IrradianceCache::solve()
};

}  // namespace

Result<TruthSwatch> trace_swatch(const CellMesh& mesh, const std::string& name, const SwatchShot& shot,
                                 const TruthOptions& options, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  if (auto ok = check_truth(shot, options, name); !ok) return tl::unexpected(ok.error());
  TruthOptions o = options;
  const auto cell = trace_cell(mesh, name, o.ground);
  if (!cell) return tl::unexpected(cell.error());
  const auto plane = plane_of(mesh, *cell, name, bake_like(o));
  if (!plane) return tl::unexpected(plane.error());
  std::optional<IrradianceCache> cache;
  if (o.indirect == IndirectLight::cached) {
    cache = IrradianceCache::build(cell->scene, seed_of(o.seed, stream_truth_cache, 0));
    if (!cache) o.indirect = IndirectLight::traced;
  }
  SwatchTracer tracer(cell->scene, cache ? &*cache : nullptr, shot, o, *plane / cell->mm, cell->mm / 1000);
  if (cache) tracer.solve(*cache);

  TruthSwatch result = draw_truth(
      shot, o,
      [&](const SwatchRay& ray, PathSampler& sampler, PathLights& lights, PixelSum& sum) {
        return tracer.trace(ray, sampler, lights, sum);
      },
      progress);
  result.indirect = o.indirect;
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace selvedge
