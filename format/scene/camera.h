// Cameras: perspective and parallel projections, from options that frame a scene or from the scene's own.
#pragma once

#include <Imath/ImathBox.h>

#include <numbers>
#include <optional>
#include <span>
#include <string>

#include "format/base/error.h"
#include "format/base/vec.h"
#include "format/scene/scene.h"

namespace selvedge {

inline constexpr double radians_per_degree = std::numbers::pi / 180;

enum class Projection { perspective, parallel };

/// The image plane is spanned by `right` and `up`; world lengths in metres. An image point (s, t) in
/// [-1, 1]^2 (right, up) lies at window_centre + (s, t) * window_half_size on this plane, which is at unit
/// distance before `position` (perspective) or contains `position` (parallel).
struct Camera {
  Projection projection = Projection::perspective;
  V3d position{0, 0, 1};
  V3d right{1, 0, 0};  ///< unit, perpendicular to `up`
  V3d up{0, 1, 0};     ///< unit
  /// Parallel only: unit direction towards the viewer, before the image plane. If it is oblique, a surface in
  /// the image plane is still shown undistorted.
  V3d to_viewer{0, 0, 1};
  V2d window_centre{0, 0};
  V2d window_half_size{1, 1};
  /// Clipping depths, measured from `position` into the picture; a parallel camera may have a negative
  /// `near`.
  double near = 0.01;
  double far = 100;

  V3d image_normal() const { return right.cross(up); }
};

Imath::Box3d bounding_box(std::span<const V3d> points);

/// World -> OpenGL clip space (row vectors: clip = p * M), for coordinates taken relative to `origin`.
M44d clip_matrix(const Camera& camera, const V3d& origin);

/// Unit direction from the surface seen at the image point (s, t) in [-1, 1]^2 towards the viewer.
V3d view_direction(const Camera& camera, const V2d& image_point);

/// Directions towards the viewer, not normalised: base + x * step_right + y * step_up, x and y in pixels from
/// the centre of the frame.
struct ViewDirections {
  V3f centre_direction;
  V3f step_right;
  V3f step_up;
};

ViewDirections view_directions(const Camera& camera, int width, int height);

struct CameraOptions {
  Projection projection = Projection::perspective;
  double azimuth = 0;            ///< degrees; 0 looks along -z (at the front of a glTF asset), 90 along -x
  double elevation = 0;          ///< degrees above the horizon, -90 to 90
  double field_of_view = 30;     ///< degrees, vertical
  std::optional<V3d> look_at{};  ///< m; default: centres the points in the frame
  std::optional<double> distance{};  ///< m from look_at; default: all points fit the frame
  double zoom = 1;                   ///< narrows the frame by this factor ...
  V2d zoom_centre{0.5, 0.5};         ///< ... around this point of it; (0, 0) top left, (1, 1) bottom right
};

/// A camera for a frame of width : height = `aspect` that shows `points` (at least one, finite; world, m)
/// with a small margin. OPTION_OUT_OF_RANGE.
Result<Camera> make_camera(std::span<const V3d> points, double aspect, const CameraOptions& options);

/// The scene's camera with the name or number `wanted`, for a frame of width : height = `aspect` that
/// contains the camera's own frame. Without a far plane the picture ends behind the last of `points` (world,
/// m). Only `zoom` and `focus` of the options apply. OPTION_OUT_OF_RANGE if the scene has no such camera.
Result<Camera> find_scene_camera(const Scene& scene, const std::string& wanted, std::span<const V3d> points,
                                 double aspect, const CameraOptions& options);

}  // namespace selvedge
