#include "converter/bake/truth_swatch.h"

#include "converter/bake/setup.h"
#include "converter/bake/truth_pixels.h"
#include "converter/light/yarn_brdf.h"
#include "format/base/guard.h"
#include "format/fabric/yarns.h"

namespace selvedge {
namespace {

/// The factor at the point that a ray meets: of cloth that varies, whose vertices know their yarn.
double factor_at(const std::optional<Yarns>& yarns, const RayScene& scene, const V2d& period_mm,
                 const SwatchRay& ray, const SurfacePoint& point) {
  if (!yarns) return 1;
  const CellMesh& mesh = scene.mesh();
  const V2d uv = ray.point * 1000.0 / period_mm * V2d(1, -1);
  return static_cast<double>(yarns->factor_at(uv, mesh.places[mesh.triangles[point.triangle].x].curve));
}

}  // namespace

Result<TruthSwatch> trace_swatch(const CellMesh& mesh, const std::string& name, const SwatchShot& shot,
                                 const TruthOptions& options, const Progress& progress) {
  const Stopwatch watch;
  return result_of([&] {
    value_or_throw(check_truth(shot, options, name));
    const TracedCell cell = value_or_throw(trace_cell(mesh, name, options.ground));
    const double plane = value_or_throw(plane_of(mesh, cell, name, bake_like(options)));
    const RayScene& scene = cell.scene;
    const PathTracer tracer(scene, options.bounces);
    const LightChoice choice(shot.lights);
    std::optional<Yarns> yarns;
    if (!mesh.places.empty()) yarns.emplace(mesh.yarns, V2f(mesh.period));
    const SwatchCell place{scene.period(), cell.mm / 1000, plane / cell.mm,
                           static_cast<double>(scene.bounds().max.z)};
    const auto trace = [&](const SwatchRay& ray, PathSampler& sampler, PathLights& lights, PixelSum& sum) {
      std::uint64_t rays = 1;
      SurfacePoint point;
      if (!scene.trace(ray_origin(ray, shot.camera, place), -ray.view, point) || scene.is_ground(point))
        return rays;
      sum.hits += 1;
      choice.choose(sampler, lights);
      const YarnBrdf surface = surface_at(scene, point);
      for (std::size_t l = 0; l < lights.directions.size(); ++l)
        lights.radiance[l] += direct_light(scene, point, surface, lights.directions[l], ray.view, rays);
      rays += tracer.add_indirect(point, ray.view, lights.directions, sampler, lights.radiance);
      lights.add_to(sum, factor_at(yarns, scene, mesh.period, ray, point));
      return rays;
    };
    TruthSwatch result = draw_truth(shot, options, trace, progress);
    result.seconds = watch.seconds();
    return result;
  });
}

}  // namespace selvedge
