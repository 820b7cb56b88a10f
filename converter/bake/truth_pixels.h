// The pixels of a traced swatch, whatever the cloth is made of: rays, lights, noise.
#pragma once

#include <functional>
#include <vector>

#include "converter/bake/truth_swatch.h"
#include "converter/light/path_tracer.h"

namespace selvedge {

/// Sums over rays.
struct PixelSum {
  V3d radiance{0, 0, 0};
  double hits = 0;
};

/// Lights of one path, what their radiance under unit irradiance counts, and that radiance.
struct PathLights {
  explicit PathLights(const std::vector<Light>& lights);
  std::vector<V3f> directions;
  std::vector<V3d> irradiances;
  std::vector<V3d> unit_radiances;
  void add_to(PixelSum& sum, double factor = 1) const {
    for (std::size_t l = 0; l < unit_radiances.size(); ++l)
      sum.radiance += unit_radiances[l] * irradiances[l] * factor;
  }
};

/// The options of a bake with those members that a truth has, too.
BakeOptions bake_options_of(const TruthOptions& options);
/// Refuses what trace_swatch() does.
Result<void> check_truth(const SwatchShot& shot, const TruthOptions& options, const std::string& name);

/// A cell that rays of a swatch meet, in units of `metres`.
struct SwatchCell {
  V2d period;
  double metres_per_unit;
  double plane_z;  ///< height of the swatch's plane
  double top_z;    ///< height of the highest point
};
/// The origin of a ray: within the cell's own repeat, above all yarn, but not behind the camera.
V3d ray_origin(const SwatchHit& ray, const Camera& camera, const SwatchCell& cell);

/// Adds one ray of a pixel. `lights` has no radiance yet.
using TraceRay = std::function<void(const SwatchHit&, PathSampler&, PathLights& lights, PixelSum& sum)>;

/// Draws the picture by rays; `seconds` is the caller's.
TruthSwatch draw_truth(const SwatchShot& shot, const TruthOptions& options, const TraceRay& trace,
                       const Progress& progress);

}  // namespace selvedge
