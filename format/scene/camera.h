// Where the picture is seen from: perspective and parallel projections, and a position found from the scene.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "format/base/error.h"
#include "format/base/vec.h"
#include "format/scene/scene.h"

namespace selvedge {

enum class Projection { perspective, parallel };

/// The image plane is spanned by `right` and `up`; world lengths in metres. A point of the image at
/// (s, t) in [-1, 1]^2 (right, up) lies at window_centre + (s, t) * window_half on that plane, which stands
/// at unit distance before `position` (perspective) or runs through `position` (parallel).
struct Camera {
  Projection projection = Projection::perspective;
  V3d position{0, 0, 1};
  V3d right{1, 0, 0};  ///< unit, perpendicular to `up`
  V3d up{0, 1, 0};     ///< unit
  /// Parallel only: unit direction towards the viewer, before the image plane. An oblique one (not
  /// perpendicular to the plane) still shows a surface that lies in the image plane undistorted.
  V3d to_viewer{0, 0, 1};
  V2d window_centre{0, 0};
  V2d window_half{1, 1};
  /// Depths between which something is drawn, measured from `position` into the picture; a parallel camera
  /// may have a negative `near`.
  double near = 0.01;
  double far = 100;

  V3d back() const { return right.cross(up); }
};

/// World -> OpenGL clip space (row vectors: clip = p * M), for coordinates taken relative to `origin`.
M44d clip_matrix(const Camera& camera, const V3d& origin);

/// Unit direction from whatever is seen at the image point (s, t) in [-1, 1]^2 towards the viewer.
V3d view_direction(const Camera& camera, const V2d& image_point);

/// How a user asks for a camera.
struct CameraOptions {
  Projection projection = Projection::perspective;
  double azimuth = 0;              ///< degrees; 0 looks along -z (at the front of a glTF asset), 90 along -x
  double elevation = 0;            ///< degrees above the horizon, -90 to 90
  double field_of_view = 30;       ///< degrees, vertical
  double distance_factor = 1;      ///< times the distance at which the points just fit the frame
  std::optional<V3d> look_at;      ///< m; default: what centres the points in the frame
  std::optional<double> distance;  ///< m from there; default: what shows all of the points
  double zoom = 1;                 ///< narrows the frame by this factor ...
  V2d focus{0.5, 0.5};             ///< ... around this point of it; (0, 0) top left, (1, 1) bottom right
};

/// A camera for a frame of width : height = `aspect` that shows `points` (at least one, finite; world, m)
/// with a small margin. OPTION_OUT_OF_RANGE where an option is.
Result<Camera> make_camera(std::span<const V3d> points, double aspect, const CameraOptions& options);

/// A camera of the scene by its name or number, for a frame of width : height = `aspect`; a file's own aspect
/// is kept whole within it. Without a far plane the picture ends behind the last of `points` (world, m).
/// `zoom` and `focus` of the options apply, the others do not. OPTION_OUT_OF_RANGE for a camera that is not
/// there.
Result<Camera> camera_of(const Scene& scene, const std::string& wanted, std::span<const V3d> points,
                         double aspect, const CameraOptions& options);

}  // namespace selvedge
