#include "converter/bake/truth_swatch.h"

#include "converter/bake/setup.h"
#include "converter/bake/truth_pixels.h"
#include "converter/light/yarn_brdf.h"
#include "format/base/guard.h"
#include "format/fabric/yarns.h"

namespace selvedge {
namespace {

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
