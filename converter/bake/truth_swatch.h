// Ray-traces the truth: a picture of a flat swatch of the stitch, repeated without end, under the lights of
// the bake. The viewer's pictures of a fabric approximate it.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "converter/bake/bake.h"
#include "format/base/progress.h"
#include "format/picture/frame.h"
#include "format/scene/swatch.h"

namespace selvedge {

struct TruthOptions {
  int samples = 64;  ///< rays per pixel, 2 to 2^20, even
  int bounces = unlimited_bounces;
  std::uint64_t seed = 1;
};

struct TruthSwatch {
  /// Radiance times opacity, and opacity, the fraction of the pixel's rays that met yarn. Unweighted means
  /// over the pixel's square.
  Frame frame;
  /// Standard error of radiance times opacity: half the difference between the means of two independent
  /// halves of the rays, as root mean square over pixels and colours.
  double noise = 0;
  double alpha_noise = 0;  ///< the same for the opacity
  double seconds = 0;
};

/// The same mesh, shot and options give the same values for any number of threads. Refuses lights that are
/// not directional and options out of range (option_out_of_range), and meshes that validate() refuses.
Result<TruthSwatch> trace_swatch(const CellMesh& mesh, const std::string& name, const SwatchShot& shot,
                                 const TruthOptions& options = {}, const Progress& progress = {});

// Parts of trace_swatch() for swatches of other cloth than a mesh.

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
