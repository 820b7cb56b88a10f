#include "viewer/lights.h"

namespace selvedge {

V3d from_camera_frame(const Camera& camera, const V3d& d) {
  return camera.right * d.x + camera.up * d.y + camera.back() * d.z;
}

std::vector<Light> default_lights(const Camera& camera) {
  const auto light = [&](const V3d& direction, float irradiance) {
    return Light{from_camera_frame(camera, direction.normalized()), V3f(irradiance)};
  };
  return {light(V3d(-0.55, 0.65, 0.8), 1.0F), light(V3d(0.9, 0.15, 0.6), 0.3F)};
}

}  // namespace selvedge
