// Where most of a scene lies, and its frame for the default camera: the cloth, without strays,
// from a side on which it has an area.
#pragma once

#include <Imath/ImathBox.h>

#include <string>
#include <vector>

#include "format/scene/camera.h"

namespace selvedge {

using SceneParts = std::vector<const SceneInstance*>;

/// Returns the box of all but 1 % of the area of the parts at either end of each axis, world, m; empty
/// without an area.
Imath::Box3d bulk_box(const Scene& scene, const SceneParts& parts);

/// Returns how far a point lies from the bulk, m; 0 within twice its diagonal: it is no stray.
double stray_distance_of(const V3d& point, const Imath::Box3d& bulk);

/// Returns the positions of the vertices that the triangles of a part use, world, m.
std::vector<V3d> used_points(const Scene& scene, const SceneInstance& part);

struct Framing {
  std::vector<V3d> points;            ///< what the frame holds, world, m
  std::vector<V3d> excluded_corners;  ///< corners of the box around what it does not hold
  /// Where cloth that the front shows nearly edge-on is better seen from, degrees, and a remark; else 0.
  double azimuth = 0, elevation = 0;
  std::string turn_remark;
  std::vector<std::string> stray_remarks;  ///< remarks on what the frame leaves out
};

/// Frames the triangles that have a fabric, or all if none has, and whole parts beside them. Strays are named
/// and left out. Errors as world_points().
Result<Framing> frame_scene(const Scene& scene);

/// Moves the clipping depths apart until they hold these points.
void widen_clipping_depths(std::span<const V3d> points, Camera& camera);

}  // namespace selvedge
