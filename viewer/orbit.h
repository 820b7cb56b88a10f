// Moves a camera by mouse: around a point, towards it, and along the picture. CameraOptions::look_at and
// ::distance hold the point and the distance and must be set.
//
// Lengths in the window are in units of its height, x to the right and y up; points of the window lie in [-1,
// 1]^2 as in camera.h.
#pragma once

#include <span>
#include <vector>

#include "format/scene/camera.h"

namespace selvedge {

/// `options` with point and distance filled in: the centre of the points, and a distance that shows all of
/// them. Errors as make_camera().
Result<CameraOptions> start_orbit(std::span<const V3d> points, double aspect, const CameraOptions& options);

/// A camera with the directions of `options` alone, which do not depend on a scene.
Camera camera_axes(const CameraOptions& options);

/// The corners of the points' bounding box, which can replace the points in make_camera() if the options have
/// point and distance.
std::vector<V3d> box_corners(std::span<const V3d> points);

/// Half a turn for a drag over the height of the window. The scene follows the mouse; the camera stops at the
/// poles.
void turn(CameraOptions& orbit, const V2d& drag);

/// Moves the camera so that the orbit's point follows the mouse.
void pan(CameraOptions& orbit, const V2d& drag);

/// Moves a tenth nearer for each step, or away for negative steps. The point under `cursor` at the orbit's
/// distance stays there. The distance is clamped to 1e-4 to 100 times `size`, the size of the scene.
void dolly(CameraOptions& orbit, double steps, const V2d& cursor, double aspect, double size);

/// Moves the orbit's point along the axis to the depth of `seen` (world, m); the camera stays. Steps towards
/// the scene then never pass through it. Does nothing if `seen` is not in front of the camera, or in parallel
/// projection, which cannot pass through the scene.
void orbit_about(CameraOptions& orbit, const V3d& seen);

/// Turns a direction in the camera's axes by a drag, as if the light were on the near side of a sphere: half
/// a turn for the height of the window.
V3d turn_light(const V3d& direction, const V2d& drag);

/// Views once around the scene in `frames` >= 1 equal steps, then with `has_top` one from above, all looking
/// at the same point from the same distance: the options' values, or the scene's centre and the distance that
/// shows everything in all frames. OPTION_OUT_OF_RANGE for a perspective view from within the points' box.
Result<std::vector<CameraOptions>> turntable(std::span<const V3d> points, double aspect,
                                             const CameraOptions& options, int frames, bool has_top = false);

}  // namespace selvedge
