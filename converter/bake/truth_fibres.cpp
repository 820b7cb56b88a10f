#include "converter/bake/truth_fibres.h"

#include <algorithm>
#include <chrono>

#include "converter/bake/setup.h"
#include "converter/bake/truth_pixels.h"
#include "converter/light/fibre_tracer.h"

namespace selvedge {

Result<TruthSwatch> trace_fibre_swatch(const Fibres& fibres, const CellMesh& mesh, const std::string& name,
                                       const SwatchShot& shot, const TruthOptions& options,
                                       const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  if (auto ok = check_truth(shot, options, name); !ok) return tl::unexpected(ok.error());
  const auto cell = trace_cell(mesh, name, {});
  if (!cell) return tl::unexpected(cell.error());
  const auto plane = plane_of(mesh, *cell, name, bake_like(options));
  if (!plane) return tl::unexpected(plane.error());
  const auto scene = FibreScene::create(fibres, name);
  if (!scene) return tl::unexpected(scene.error());
  const FibreTracer tracer(*scene, fibres.yarns, options.bounces);
  const LightChoice choice(shot.lights);
  const double low = static_cast<double>(bounds_of(mesh).min.z);
  const SwatchCell place{scene->period(), 1e-3, low + *plane, scene->high()};

  TruthSwatch result = draw_truth(
      shot, options,
      [&](const SwatchRay& ray, PathSampler& sampler, PathLights& lights, PixelSum& sum) {
        std::uint64_t rays = 1;
        FibrePoint point;
        if (!scene->trace(ray_origin(ray, shot.camera, place), -ray.view, point)) return rays;
        sum.hits += 1;
        choice.choose(sampler, lights);
        tracer.follow(point, lights.directions, sampler, lights.radiance, rays);
        lights.add_to(sum);
        return rays;
      },
      progress);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace selvedge
