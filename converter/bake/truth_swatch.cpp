#include "converter/bake/truth_swatch.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numbers>
#include <span>
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

/// Lights of one path, and what their radiance under unit irradiance counts.
struct PathLights {
  std::vector<V3f> directions;
  std::vector<V3d> irradiance;
};

/// All of a few lights; of many, those that send most and one of the others, which stands for them.
class LightChoice {
 public:
  explicit LightChoice(const std::vector<Light>& lights) {
    constexpr std::size_t few = 8;
    constexpr double large_share = 1.0 / 32;
    const auto power = [](const Light& light) {
      return static_cast<double>(light.irradiance.x + light.irradiance.y + light.irradiance.z);
    };
    double whole = 0;
    for (const Light& light : lights) whole += power(light);
    for (const Light& light : lights) {
      const bool is_sure = lights.size() <= few || power(light) >= large_share * whole;
      PathLights& of = is_sure ? sure_ : others_;
      of.directions.emplace_back(light.direction.normalized());
      of.irradiance.emplace_back(light.irradiance);
      if (!is_sure) up_to_.push_back((up_to_.empty() ? 0 : up_to_.back()) + power(light));
    }
  }

  void choose(PathSampler& sampler, PathLights& chosen) const {
    chosen = sure_;
    if (up_to_.empty()) return;
    const auto found = std::upper_bound(up_to_.begin(), up_to_.end(), sampler.next().x * up_to_.back());
    const std::size_t i = std::min<std::size_t>(found - up_to_.begin(), up_to_.size() - 1);
    const double power = up_to_[i] - (i > 0 ? up_to_[i - 1] : 0);
    if (!(power > 0)) return;
    chosen.directions.push_back(others_.directions[i]);
    chosen.irradiance.push_back(others_.irradiance[i] * (up_to_.back() / power));
  }

 private:
  PathLights sure_;
  PathLights others_;
  std::vector<double> up_to_;  ///< sums of what the others send
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
        metres_(metres),
        choice_(shot.lights) {
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
    PathLights lights;
    std::vector<V3d> radiance;
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
      choice_.choose(sampler, lights);
      radiance.assign(lights.directions.size(), V3d(0, 0, 0));
      rays += light_directly(point, ray->view, lights.directions, radiance);
      if (cache_ == nullptr) {
        rays += tracer_.add_indirect(point, ray->view, lights.directions, sampler, radiance);
      } else {
        gather.radiance += indirect_light(point);
      }
      for (std::size_t l = 0; l < radiance.size(); ++l) gather.radiance += radiance[l] * lights.irradiance[l];
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

  std::uint64_t light_directly(const SurfacePoint& point, const V3d& view, std::span<const V3f> lights,
                               std::span<V3d> radiance) const {
    const YarnSurface surface = surface_at(scene_, point);
    std::uint64_t rays = 0;
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const V3d light(lights[l]);
      const double cosine = surface.normal.dot(light);
      if (!(cosine > 0)) continue;
      ++rays;
      if (scene_.occluded(point, lights[l])) continue;
      radiance[l] += reflectance(surface, light, view) * cosine;
    }
    return rays;
  }

  V3d indirect_light(const SurfacePoint& point) const {
    CacheTaps taps;
    V3d sum(0, 0, 0);
    if (!cache_->taps(point, taps)) return sum;
    const V3d factor = V3d(albedo_with_gloss(scene_, point)) * std::numbers::inv_pi;
    const std::size_t n = lights_.size();
    for (std::size_t k = 0; k < 3; ++k) {
      const float* row = &irradiance_of_points_[taps.point[k] * 3 * n];
      for (std::size_t l = 0; l < n; ++l) {
        sum += irradiance_[l] * V3d(V3f(row[l], row[n + l], row[2 * n + l])) *
               static_cast<double>(taps.weight[k]);
      }
    }
    return factor * sum;
  }

  const RayScene& scene_;
  const IrradianceCache* cache_;
  PathTracer tracer_;
  const SwatchShot& shot_;
  const TruthOptions& options_;
  double plane_;
  double metres_;
  LightChoice choice_;
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
