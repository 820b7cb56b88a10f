// Conservative bounds of the area of a fabric that pixels cover, from a camera or from all directions at a
// range of distances, without drawing. footprint.h computes the footprint of a single pixel.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <span>
#include <variant>
#include <vector>

#include "format/base/error.h"
#include "format/scene/camera.h"
#include "format/scene/scene.h"

namespace selvedge {

/// All cameras that make_camera() makes for a scene and some options, from any azimuth and elevation and any
/// distance in a range. As in CameraOptions, a distance is that of the eye from the centre of the scene's
/// bounding box, along the camera's axis.
struct Orbit {
  double nearest = 1;  ///< m
  double farthest = 1;
  V3d middle{0, 0, 0};
  V2d reach{0, 0};  ///< m; a point z before the middle is at most reach - slope z away from the axis
  V2d slope{1, 1};
  V2d window_half{1, 1};  ///< as in Camera; in parallel projection at the distance 1
  V2d window_centre{0, 0};
  Projection projection = Projection::perspective;
};

/// An orbit around `points` (at least one, finite; world, m) for frames of width : height = `aspect`.
/// `options` gives projection, field of view, zoom and focus; distances are in m. OPTION_OUT_OF_RANGE as
/// make_camera(), for distances that are not a range, and if the options have a point to look at.
Result<Orbit> make_orbit(std::span<const V3d> points, double aspect, double nearest, double farthest,
                         const CameraOptions& options);

using Viewpoints = std::variant<Camera, Orbit>;

/// Bounds of the footprints of all pixels that show a fabric.
struct PixelCover {
  /// Lower bound of pixel_size(); infinite if no pixel shows the fabric, 0 if unbounded.
  double min_size = HUGE_VAL;
  /// Upper bound of it; 0 if no pixel shows the fabric, infinite if unbounded.
  double max_size = 0;
  bool fronts = false;  ///< front sides may be seen
  bool backs = false;   ///< back sides may be seen

  PixelCover& operator|=(const PixelCover& other);
};

/// The cover of each material in all frames of `height` pixels from these viewpoints. `units[i]`: number of
/// units along u and v of a repeat of material i, such as texels of level 0 or millimetres. Occluded surfaces
/// count as seen; materials without a fabric and culled sides do not.
std::vector<PixelCover> pixel_covers(const Scene& scene, const Viewpoints& viewpoints, int height,
                                     std::span<const V2d> units);

/// Of a triangle at `points` (world, m) with texture coordinates `at`: a lower bound of the step, in their
/// units, between some pixel of it and its neighbour to the right or above, the longer of the two, in frames
/// from `camera`; infinite if no pixel shows the triangle.
using StepBound = std::function<double(const std::array<V3d, 3>& points, const std::array<V2d, 3>& at)>;
/// For frames of `height` pixels. `camera` must outlive it.
StepBound step_bound(const Camera& camera, int height);

}  // namespace selvedge
