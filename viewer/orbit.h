// A camera that is moved by hand: around a point, towards it, and along the picture. The point and the
// distance are CameraOptions::look_at and ::distance, which must be set.
//
// Lengths in the window are measured in its heights, x to the right and y up; a point of the window in [-1,
// 1]^2 as in camera.h.
#pragma once

#include <span>

#include "format/scene/camera.h"

namespace selvedge {

/// `options` with its point and distance filled in: the centre of the points, and where all of them are seen.
/// Errors as make_camera().
Result<CameraOptions> start_orbit(std::span<const V3d> points, double aspect, const CameraOptions& options);

/// The corners of the box around the points: as good for make_camera() where the options say point and
/// distance, and fewer.
std::vector<V3d> box_corners(std::span<const V3d> points);

/// Half a turn for a drag over the height of the window. What is dragged follows the hand; the camera never
/// goes over the top.
void turn(CameraOptions& orbit, const V2d& drag);

/// What lies at the orbit's point follows the hand.
void pan(CameraOptions& orbit, const V2d& drag);

/// Comes nearer by a tenth for each step, or goes away for negative ones. What lies at the distance of the
/// orbit's point under `cursor` stays there. The distance keeps within 1e-4 and 100 times `size`, the size
/// of the scene.
void dolly(CameraOptions& orbit, double steps, const V2d& cursor, double aspect, double size);

/// Turns and steps are from now on about what is seen: the orbit's point moves along the axis to the depth of
/// `seen` (world, m), and the camera stays. Steps towards the scene then never pass through it. Nothing for
/// what does not lie before the camera, nor in parallel projection, where nothing is passed.
void orbit_about(CameraOptions& orbit, const V3d& seen);

/// A direction in the camera's axes, turned by a drag as if the light hung on the near side of a sphere: half
/// a turn for the height of the window.
V3d turn_light(const V3d& direction, const V2d& drag);

}  // namespace selvedge
