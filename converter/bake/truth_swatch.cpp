#include "converter/bake/truth_swatch.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numbers>
#include <vector>

#include "converter/bake/setup.h"
#include "converter/light/irradiance_cache.h"
#include "converter/light/sobol.h"
#include "converter/light/yarn_brdf.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

// Independent streams of random numbers.
constexpr std::uint64_t stream_pixels = 101;
constexpr std::uint64_t stream_paths = 102;
constexpr std::uint64_t stream_cache = 103;

/// Sums over rays.
struct Gather {
  V3d radiance{0, 0, 0};
  double hits = 0;
};

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
        plane_(plane),
        metres_(metres) {
    for (const Light& light : shot.lights) {
      lights_.emplace_back(light.direction.normalized());
      irradiance_.emplace_back(light.irradiance);
    }
  }

  void solve(IrradianceCache& cache) {
    irradiance_of_points_ = cache.solve(scene_, lights_, options_.bounces);
  }

  /// Traces one half of the rays of a pixel.
  Gather trace(int x, int y, std::uint64_t half) const {
    const auto pixel = static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(shot_.width) +
                       static_cast<std::uint64_t>(x);
    const std::uint64_t places = seed_of(options_.seed, stream_pixels, 2 * pixel + half);
    const std::uint64_t paths = seed_of(options_.seed, stream_paths, 2 * pixel + half);
    Gather gather;
    std::vector<V3d> radiance(lights_.size());
    std::uint64_t rays = 0;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(options_.samples / 2); ++i) {
      const V2d within = spread_point(i, places);
      const auto ray = swatch_ray(
          shot_.camera, {2 * (x + within.x) / shot_.width - 1, 1 - 2 * (y + within.y) / shot_.height});
      if (!ray) continue;
      ++rays;
      SurfacePoint point;
      if (!scene_.trace(origin(*ray), -ray->view, point) || scene_.is_ground(point)) continue;
      gather.hits += 1;
      PathSampler sampler(i, paths);
      std::fill(radiance.begin(), radiance.end(), V3d(0, 0, 0));
      rays += light_directly(point, ray->view, radiance);
      if (cache_ == nullptr) {
        rays += tracer_.add_indirect(point, ray->view, lights_, sampler, radiance);
      } else {
        light_indirectly(point, radiance);
      }
      for (std::size_t l = 0; l < lights_.size(); ++l) gather.radiance += radiance[l] * irradiance_[l];
    }
    rays_.fetch_add(rays, std::memory_order_relaxed);
    return gather;
  }

  std::uint64_t rays() const { return rays_; }

 private:
  /// The origin of a ray: within the cell's own repeat, above all yarn, but not behind the camera.
  V3d origin(const SwatchRay& ray) const {
    const V2d period = scene_.period();
    V2d point = ray.point / metres_;
    point -= V2d(std::floor(point.x / period.x), std::floor(point.y / period.y)) * period;
    double back = (static_cast<double>(scene_.bounds().max.z) - plane_ + period.x) / ray.view.z;
    if (shot_.camera.projection == Projection::perspective) back = std::min(back, ray.distance / metres_);
    return V3d(point.x, point.y, plane_) + ray.view * back;
  }

  std::uint64_t light_directly(const SurfacePoint& point, const V3d& view, std::vector<V3d>& radiance) const {
    const YarnSurface surface = surface_at(scene_, point);
    std::uint64_t rays = 0;
    for (std::size_t l = 0; l < lights_.size(); ++l) {
      const V3d light(lights_[l]);
      const double cosine = surface.normal.dot(light);
      if (!(cosine > 0)) continue;
      ++rays;
      if (scene_.occluded(point, lights_[l])) continue;
      radiance[l] += reflectance(surface, light, view) * cosine;
    }
    return rays;
  }

  void light_indirectly(const SurfacePoint& point, std::vector<V3d>& radiance) const {
    CacheTaps taps;
    if (!cache_->taps(point, taps)) return;
    const V3d factor = V3d(albedo_with_gloss(scene_, point)) * std::numbers::inv_pi;
    const std::size_t n = lights_.size();
    for (std::size_t k = 0; k < 3; ++k) {
      const float* row = &irradiance_of_points_[taps.point[k] * 3 * n];
      for (std::size_t l = 0; l < n; ++l) {
        radiance[l] +=
            factor * V3d(V3f(row[l], row[n + l], row[2 * n + l])) * static_cast<double>(taps.weight[k]);
      }
    }
  }

  const RayScene& scene_;
  const IrradianceCache* cache_;
  PathTracer tracer_;
  const SwatchShot& shot_;
  const TruthOptions& options_;
  double plane_;
  double metres_;
  std::vector<V3f> lights_;
  std::vector<V3d> irradiance_;
  std::vector<float> irradiance_of_points_;  ///< the result of IrradianceCache::solve()
  mutable std::atomic<std::uint64_t> rays_{0};
};

/// Checks the options that a bake has, too, by the bake's own rules.
BakeOptions as_bake(const TruthOptions& o) {
  BakeOptions bake;
  bake.samples = o.samples;
  bake.bounces = o.bounces;
  bake.ground = o.ground;
  bake.reference = o.reference;
  bake.seed = o.seed;
  return bake;
}

Result<void> check(const SwatchShot& shot, const TruthOptions& o, const std::string& name) {
  if (auto ok = check_options(as_bake(o), name); !ok) return ok;
  // The noise is estimated from two halves.
  if (o.samples < 2 || o.samples % 2 != 0)
    return fail(Code::option_out_of_range, name, "samples", "must be even, and 2 at least");
  for (const Light& light : shot.lights) {
    if (light.kind != LightKind::directional)
      return fail(Code::option_out_of_range, name, "light",
                  "must be far away: the truth has no other lights");
  }
  return {};
}

}  // namespace

Result<TruthSwatch> trace_swatch(const CellMesh& mesh, const std::string& name, const SwatchShot& shot,
                                 const TruthOptions& options, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  if (auto ok = check(shot, options, name); !ok) return tl::unexpected(ok.error());
  TruthOptions o = options;
  const auto cell = trace_cell(mesh, name, o.ground);
  if (!cell) return tl::unexpected(cell.error());
  const auto plane = plane_of(mesh, *cell, name, as_bake(o));
  if (!plane) return tl::unexpected(plane.error());
  std::optional<IrradianceCache> cache;
  if (o.indirect == IndirectLight::cached) {
    cache = IrradianceCache::build(cell->scene, seed_of(o.seed, stream_cache, 0));
    if (!cache) o.indirect = IndirectLight::traced;
  }
  SwatchTracer tracer(cell->scene, cache ? &*cache : nullptr, shot, o, *plane / cell->mm, cell->mm / 1000);
  if (cache) tracer.solve(*cache);

  TruthSwatch result;
  result.indirect = o.indirect;
  const std::size_t width = shot.width;
  const std::size_t rows = shot.height;
  result.frame = {shot.width, shot.height, std::vector<V4f>(width * rows)};
  std::vector<V2d> errors(rows, V2d(0, 0));  // squared, of colours (x) and opacity (y)
  constexpr int rows_at_once = 8;
  for (int first = 0; first < shot.height; first += rows_at_once) {
    parallel_for(first, std::min(first + rows_at_once, shot.height), [&](int y) {
      for (int x = 0; x < shot.width; ++x) {
        const Gather a = tracer.trace(x, y, 0);
        const Gather b = tracer.trace(x, y, 1);
        const V3f mean((a.radiance + b.radiance) / o.samples);
        result.frame.pixels[y * width + x] =
            V4f(mean.x, mean.y, mean.z, static_cast<float>((a.hits + b.hits) / o.samples));
        const double alpha = (a.hits - b.hits) / o.samples;
        errors[y] += V2d(((a.radiance - b.radiance) / o.samples).length2(), alpha * alpha);
      }
    });
    if (progress) progress(std::min(1.0, static_cast<double>(first + rows_at_once) / shot.height));
  }
  V2d sum(0, 0);
  for (const V2d& row : errors) sum += row;
  const double pixels = static_cast<double>(shot.width) * shot.height;
  result.noise = std::sqrt(sum.x / (3 * pixels));
  result.alpha_noise = std::sqrt(sum.y / pixels);
  result.rays = tracer.rays();
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace selvedge
