#include "format/scene/lights.h"

#include <algorithm>
#include <cmath>

namespace selvedge {
Illumination illumination_at(const Light& light, const V3d& point) {
  constexpr double max_fraction = 1e24;  // irradiances near a light stay finite
  if (light.kind == LightKind::directional) return {light.direction, light.irradiance};
  const V3d towards = light.position - point;
  const double distance2 = towards.length2();
  if (!(distance2 > 0) || !std::isfinite(distance2)) return {light.direction, V3f(0)};
  const V3d direction = towards / std::sqrt(distance2);
  double fraction = 1 / distance2;
  if (light.range > 0) {
    const double r2 = distance2 / (light.range * light.range);
    fraction *= std::clamp(1 - r2 * r2, 0.0, 1.0);
  }
  if (light.kind == LightKind::spot) {
    const double cosine = direction.dot(light.direction);
    const double t = std::clamp(
        (cosine - light.outer_cosine) / std::max(light.inner_cosine - light.outer_cosine, 1e-3), 0.0, 1.0);
    fraction *= t * t;
  }
  return {direction, light.irradiance * static_cast<float>(std::min(fraction, max_fraction))};
}

std::vector<Light> scene_lights(const Scene& scene) {
  std::vector<Light> lights;
  for (const SceneLight& source : scene.lights) {
    Light light{.direction = -source.direction,
                .irradiance = source.color * source.intensity,
                .kind = source.kind,
                .position = source.position,
                .range = source.range,
                .inner_cosine = std::cos(source.inner_cone),
                .outer_cosine = std::cos(source.outer_cone)};
    lights.push_back(light);
  }
  return lights;
}

V3d camera_to_world(const Camera& camera, const V3d& d) {
  return camera.right * d.x + camera.up * d.y + camera.image_normal() * d.z;
}

std::vector<Light> camera_to_world(const Camera& camera, std::vector<Light> lights) {
  for (Light& light : lights)
    if (light.kind == LightKind::directional) light.direction = camera_to_world(camera, light.direction);
  return lights;
}

std::vector<Light> key_and_fill_lights() {
  Light key{.direction = V3d(-0.55, 0.65, 0.8).normalized()};
  Light fill{.direction = V3d(0.9, 0.15, 0.6).normalized(), .irradiance = V3f(0.3F)};
  return {key, fill};
}

std::vector<Light> default_lights(const Camera& camera) {
  return camera_to_world(camera, key_and_fill_lights());
}

}  // namespace selvedge
