// Directions from the pixels of a frame towards the viewer.
#pragma once

#include "format/scene/camera.h"

namespace selvedge {

/// Directions towards the viewer, not normalised: base + x * step_right + y * step_up, x and y in pixels from
/// the centre of the frame.
struct ViewDirections {
  V3f centre_direction;
  V3f step_right;
  V3f step_up;
};

inline ViewDirections view_directions(const Camera& camera, int width, int height) {
  if (camera.projection == Projection::parallel) return {V3f(camera.to_viewer), V3f(0), V3f(0)};
  const V3d base =
      camera.image_normal() - camera.right * camera.window_centre.x - camera.up * camera.window_centre.y;
  return {V3f(base), V3f(camera.right * (-2 * camera.window_half_size.x / width)),
          V3f(camera.up * (-2 * camera.window_half_size.y / height))};
}

}  // namespace selvedge
