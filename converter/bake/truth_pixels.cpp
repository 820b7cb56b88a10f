#include "converter/bake/truth_pixels.h"

#include <algorithm>
#include <cmath>

#include "converter/bake/setup.h"
#include "format/base/parallel.h"

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

}  // namespace

PathLights::PathLights(const std::vector<Light>& lights) : unit_radiances(lights.size()) {
  for (const Light& light : lights) {
    directions.emplace_back(light.direction.normalized());
    irradiances.emplace_back(light.irradiance);
  }
}

BakeOptions bake_options_of(const TruthOptions& o) {
  BakeOptions bake;
  bake.samples = o.samples;
  bake.bounces = o.bounces;
  bake.seed = o.seed;
  return bake;
}

Result<void> check_truth(const SwatchShot& shot, const TruthOptions& o, const std::string& name) {
  if (auto ok = check_options(bake_options_of(o), name); !ok) return ok;
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

}  // namespace selvedge
