// Where the light comes from.
#pragma once

#include <vector>

#include "format/scene/camera.h"
#include "format/scene/scene.h"

namespace selvedge {

/// The largest intensity of a light on a command line; times a share of a point light's, which is held at
/// 1e24, it is still finite.
inline constexpr double max_intensity = 1e12;

/// A light far away, or one at a point (KHR_lights_punctual).
struct Light {
  V3d direction{0, 0, 1};   ///< unit, world, towards the light; spot: against the axis of its cone
  V3f irradiance{1, 1, 1};  ///< on a surface that faces it; 1 makes the picture show the fabric's f itself.
                            ///< Point and spot: at a distance of 1 m
  LightKind kind = LightKind::directional;
  V3d position{0, 0, 0};   ///< point and spot: m, world
  double range = 0;        ///< point and spot: m, where the light ends; 0: nowhere
  double cos_inner = 1;    ///< spot: full light where the angle's cosine is above ...
  double cos_outer = 0.7;  ///< ... and none where it is below; below cos_inner
};

/// The light that falls on a point.
struct Illumination {
  V3d direction{0, 0, 1};   ///< unit, world, towards the light
  V3f irradiance{0, 0, 0};  ///< on a surface that faces it
};

/// The light at a point (m, world). Falls off with the square of the distance; towards the end of the range
/// it is windowed, and between the angles of the cone it falls smoothly, as KHR_lights_punctual recommends. A
/// point at the light's own place gets nothing.
Illumination light_at(const Light& light, const V3d& point);

/// `share` of light_at()'s irradiance, and its direction.
struct LightShare {
  V3d direction{0, 0, 1};
  double share = 0;
};
LightShare light_share_at(const Light& light, const V3d& point);

/// The lights of a scene; lux and candela are taken as they are.
std::vector<Light> lights_of(const Scene& scene);

/// `d` in the camera's axes (right, up, towards the viewer) as a world direction.
V3d from_camera_frame(const Camera& camera, const V3d& d);

/// Lights far away whose directions are given in the camera's axes; those at a place stay there.
std::vector<Light> from_camera_frame(const Camera& camera, std::vector<Light> lights);

/// A key light of irradiance 1 from the upper left and a fill light of 0.3 from the right of a viewer on +z.
std::vector<Light> key_and_fill_lights();

/// Both in the camera's axes: a white Lambertian surface that faces the camera gets a radiance of about 1 /
/// pi.
std::vector<Light> default_lights(const Camera& camera);

}  // namespace selvedge
