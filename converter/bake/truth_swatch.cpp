#include "converter/bake/truth_swatch.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "converter/bake/setup.h"
#include "converter/light/yarn_brdf.h"
#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/fabric/yarns.h"

namespace selvedge {
namespace {

// Independent streams of random numbers.
constexpr std::uint64_t stream_pixels = 101;
constexpr std::uint64_t stream_paths = 102;

/// Traces one half of the rays of a pixel.
PixelSum trace_half(const SwatchShot& shot, const TruthOptions& options, const TraceRay& trace, int x, int y,
                    std::uint64_t half) {
  const auto pixel =
      static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(shot.width) + static_cast<std::uint64_t>(x);
  const std::uint64_t places = seed_of(options.seed, stream_pixels, 2 * pixel + half);
  const std::uint64_t paths = seed_of(options.seed, stream_paths, 2 * pixel + half);
  PixelSum sum;
  PathLights lights(shot.lights);
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(options.samples / 2); ++i) {
    const V2d within = sobol_point(i, places);
    const auto ray = find_swatch_hit(
        shot.camera, {2 * (x + within.x) / shot.width - 1, 1 - 2 * (y + within.y) / shot.height});
    if (!ray) continue;
    PathSampler sampler(i, paths);
    std::ranges::fill(lights.unit_radiances, V3d(0, 0, 0));
    trace(*ray, sampler, lights, sum);
  }
  return sum;
}

/// Refuses what trace_swatch() does.
Result<void> check_truth(const SwatchShot& shot, const TruthOptions& o, const std::string& name) {
  BakeOptions bake{.samples = o.samples, .bounces = o.bounces};
  if (auto ok = check_options(bake, name); !ok) return ok;
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

/// Cloth that varies beyond its repeat: its vertices know their yarn.
class Varied {
 public:
  explicit Varied(const CellMesh& mesh) : mesh_(mesh) {
    if (!mesh.yarn_places.empty()) yarns_.emplace(mesh.yarns, V2f(mesh.period));
  }
  /// The ray where the cell is met that lies at its point.
  SwatchHit placed(const SwatchHit& ray) const {
    SwatchHit result = ray;
    if (yarns_)
      result.point_m += (displaced_place(yarns_->variation(), uv_of(ray)) - uv_of(ray)) / per_metre();
    return result;
  }
  /// The factor at the point that a placed ray meets.
  double factor(const SwatchHit& ray, const SurfacePoint& point) const {
    if (!yarns_) return 1;
    const int curve = mesh_.yarn_places[mesh_.triangles[point.triangle].x].curve;
    return static_cast<double>(yarns_->variation_factor(uv_of(ray), curve));
  }

 private:
  V2d per_metre() const { return V2d(1000.0, -1000.0) / mesh_.period; }
  V2d uv_of(const SwatchHit& ray) const { return ray.point_m * per_metre(); }

  const CellMesh& mesh_;
  std::optional<Yarns> yarns_;
};

}  // namespace

PathLights::PathLights(const std::vector<Light>& lights) : unit_radiances(lights.size()) {
  for (const Light& light : lights) {
    directions.emplace_back(light.direction.normalized());
    irradiances.emplace_back(light.irradiance);
  }
}

V3d ray_origin(const SwatchHit& ray, const Camera& camera, const SwatchCell& cell) {
  V2d point = ray.point_m / cell.metres_per_unit;
  point -= V2d(std::floor(point.x / cell.period.x), std::floor(point.y / cell.period.y)) * cell.period;
  double back = (cell.top_z - cell.plane_z + cell.period.x) / ray.view.z;
  if (camera.projection == Projection::perspective)
    back = std::min(back, ray.distance / cell.metres_per_unit);
  return V3d(point.x, point.y, cell.plane_z) + ray.view * back;
}

TruthSwatch draw_truth(const SwatchShot& shot, const TruthOptions& options, const TraceRay& trace,
                       const Progress& progress) {
  TruthSwatch result;
  const std::size_t width = shot.width;
  const std::size_t rows = shot.height;
  result.frame = {shot.width, shot.height, std::vector<V4f>(width * rows)};
  std::vector<V2d> errors(rows, V2d(0, 0));  // squared, of colours (x) and opacity (y)
  constexpr int rows_at_once = 8;
  for (int first = 0; first < shot.height; first += rows_at_once) {
    parallel_for(first, std::min(first + rows_at_once, shot.height), [&](int y) {
      for (int x = 0; x < shot.width; ++x) {
        const PixelSum a = trace_half(shot, options, trace, x, y, 0);
        const PixelSum b = trace_half(shot, options, trace, x, y, 1);
        const V3f mean((a.radiance + b.radiance) / options.samples);
        result.frame.pixels[y * width + x] =
            V4f(mean.x, mean.y, mean.z, static_cast<float>((a.hits + b.hits) / options.samples));
        const double alpha = (a.hits - b.hits) / options.samples;
        errors[y] += V2d(((a.radiance - b.radiance) / options.samples).length2(), alpha * alpha);
      }
    });
    if (progress) progress(std::min(1.0, static_cast<double>(first + rows_at_once) / shot.height));
  }
  V2d sum(0, 0);
  for (const V2d& row : errors) sum += row;
  const double pixels = static_cast<double>(shot.width) * shot.height;
  result.noise = std::sqrt(sum.x / (3 * pixels));
  result.alpha_noise = std::sqrt(sum.y / pixels);
  return result;
}

Result<TruthSwatch> trace_swatch(const CellMesh& mesh, const std::string& name, const SwatchShot& shot,
                                 const TruthOptions& options, const Progress& progress) {
  const Stopwatch watch;
  return catch_failure([&] {
    value_or_throw(check_truth(shot, options, name));
    const TracedCell cell = value_or_throw(trace_cell(mesh, name));
    const double plane = plane_height_fraction * cell.thickness_mm();
    const RayScene& scene = cell.scene;
    const PathTracer tracer(scene, options.bounces);
    const Varied varied(mesh);
    const SwatchCell place{scene.period(), cell.mm_per_unit / 1000, plane / cell.mm_per_unit,
                           static_cast<double>(scene.bounds().max.z)};
    const auto trace = [&](const SwatchHit& of_pixel, PathSampler& sampler, PathLights& lights,
                           PixelSum& sum) {
      SurfacePoint point;
      const SwatchHit ray = varied.placed(of_pixel);
      if (!scene.trace(ray_origin(ray, shot.camera, place), -ray.view, point)) return;
      sum.hits += 1;
      const YarnBrdf surface = brdf_at(scene, point);
      for (std::size_t l = 0; l < lights.directions.size(); ++l)
        lights.unit_radiances[l] += direct_light(scene, point, surface, lights.directions[l], ray.view);
      tracer.add_indirect(point, ray.view, lights.directions, sampler, lights.unit_radiances);
      lights.add_to(sum, varied.factor(ray, point));
    };
    TruthSwatch result = draw_truth(shot, options, trace, progress);
    result.seconds = watch.seconds();
    return result;
  });
}

}  // namespace selvedge
