// Frames a scene for a camera that is told nothing: the cloth, without strays, from a side on which it has an
// area. area.
#pragma once

#include <string>
#include <vector>

#include "format/scene/camera.h"

namespace selvedge {

struct Framing {
  std::vector<V3d> points;    ///< what the frame holds, world, m
  std::vector<V3d> left_out;  ///< corners of the box around what it does not hold
  /// Where cloth that the front shows nearly edge-on is better seen from, degrees, and a remark; else 0.
  double azimuth = 0, elevation = 0;
  std::string turned;
  std::vector<std::string> strays;  ///< remarks on what the frame leaves out
};

/// Frames the triangles that have a fabric, or all if none has, and whole parts beside them. Parts that lie
/// far from 98 % of the area are named and left out. Errors as world_points().
Result<Framing> frame_scene(const Scene& scene);

/// Moves the clipping depths apart until they hold these points.
void show_depths(std::span<const V3d> points, Camera& camera);

}  // namespace selvedge
