// How much of a fabric pixels cover, from a camera or from all around at some distance, known before any of
// them is drawn: bounds, never too narrow. footprint.h has the formula of a pixel itself.
#pragma once

#include <cmath>
#include <span>
#include <variant>
#include <vector>

#include "format/base/error.h"
#include "format/scene/camera.h"
#include "format/scene/scene.h"

namespace selvedge {

/// All cameras that make_camera() makes of a scene with some options, from any azimuth and elevation and from
/// any distance of a range. Distances are those of CameraOptions: of the eye, along its axis, from the middle
/// of the box around the scene.
struct Orbit {
  double nearest = 1;  ///< m
  double farthest = 1;
  V3d middle{0, 0, 0};
  V2d reach{0, 0};  ///< m; a point z before the middle is seen at most reach - slope z aside of the axis
  V2d slope{1, 1};
  V2d window_half{1, 1};  ///< as those of Camera; in parallel projection at the distance 1
  V2d window_centre{0, 0};
  Projection projection = Projection::perspective;
};

/// An orbit around `points` (at least one, finite; world, m) for frames of width : height = `aspect`.
/// `options` gives projection, field of view, zoom and focus, `nearest` and `farthest` the distance.
/// OPTION_OUT_OF_RANGE as make_camera(), for distances that are not a range, and for options that name a
/// point to look at.
Result<Orbit> make_orbit(std::span<const V3d> points, double aspect, double nearest, double farthest,
                         const CameraOptions& options);

/// From where a scene is seen.
using Viewpoints = std::variant<Camera, Orbit>;

/// How much of a fabric the pixels that show it cover.
struct PixelCover {
  /// At least so much lies across the shorter axis of any pixel's footprint; infinite where none shows it, 0
  /// where there is no bound.
  double least = HUGE_VAL;
  /// At most so much lies across one of the `taps` parts of any pixel's footprint; 0 where none shows it,
  /// infinite where there is no bound.
  double most = 0;
  bool fronts = false;  ///< whether they may be seen
  bool backs = false;

  PixelCover& operator|=(const PixelCover& other);
};

/// The cover of each material in all frames of `height` pixels from these viewpoints. `units[i]`: how many
/// units lie along u and v of a repeat of material i, such as texels of level 0 or millimetres. Surfaces that
/// others hide count as seen; materials without a fabric do not, nor does a side that its material does not
/// show. Precondition: 1 <= taps.
std::vector<PixelCover> pixel_covers(const Scene& scene, const Viewpoints& viewpoints, int height, int taps,
                                     std::span<const V2d> units);

}  // namespace selvedge
