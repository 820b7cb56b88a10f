// Where the light comes from.
#pragma once

#include <vector>

#include "viewer/camera.h"

namespace selvedge {

/// A light far away.
struct Light {
  V3d direction{0, 0, 1};   ///< unit, world, towards the light
  V3f irradiance{1, 1, 1};  ///< on a surface that faces it; 1 makes the picture show the fabric's f itself
};

/// `d` in the camera's axes (right, up, towards the viewer) as a world direction.
V3d from_camera_frame(const Camera& camera, const V3d& d);

/// A key light of irradiance 1 from the upper left of the camera and a fill light of 0.3 from its right: a
/// white Lambertian surface that faces the camera gets a radiance of about 1 / pi.
std::vector<Light> default_lights(const Camera& camera);

}  // namespace selvedge
