// Lights of a picture: directional, point and spot lights, and the irradiance that they cause.
#pragma once

#include <vector>

#include "format/scene/camera.h"
#include "format/scene/scene.h"

namespace selvedge {

/// The largest intensity of a light on a command line. Its product with the largest fraction of a point
/// light, 1e24, is finite in single precision.
inline constexpr double max_intensity = 1e12;

/// A light as in KHR_lights_punctual.
struct Light {
  V3d direction{0, 0, 1};   ///< unit, world, towards the light; spot: against the axis of its cone
  V3f irradiance{1, 1, 1};  ///< on a surface that faces the light; with 1 the picture shows the fabric's f.
                            ///< Point and spot: at a distance of 1 m
  LightKind kind = LightKind::directional;
  V3d position{0, 0, 0};  ///< point and spot: m, world
  double range = 0;       ///< point and spot: m, where the light ends; 0: infinite
  double inner_cosine =
      1;  ///< spot: full irradiance if the cosine of the angle to the axis is above this ...
  double outer_cosine = 0.7;         ///< ... and 0 if it is below this; below inner_cosine
  bool is_environment_part = false;  ///< a bright part of one, which mirrors show by themselves
  bool operator==(const Light&) const = default;
};

/// Light that arrives at a point.
struct Illumination {
  V3d direction{0, 0, 1};   ///< unit, world, towards the light
  V3f irradiance{0, 0, 0};  ///< on a surface that faces the light
};

/// Illumination of a point (m, world). Point and spot lights fall off with the square of the distance,
/// windowed towards the end of the range, and smoothly between the angles of the cone, as KHR_lights_punctual
/// recommends. 0 at the position of the light.
Illumination illumination_at(const Light& light, const V3d& point);

/// The lights of a scene; lux and candela become irradiance without a factor.
std::vector<Light> scene_lights(const Scene& scene);

/// `d` in the camera's axes (right, up, towards the viewer) as a world direction.
V3d camera_to_world(const Camera& camera, const V3d& d);

/// Transforms directional lights from the camera's axes to the world; point and spot lights are unchanged.
std::vector<Light> camera_to_world(const Camera& camera, std::vector<Light> lights);

/// A key light of irradiance 1 from the upper left and a fill light of 0.3 from the right of a viewer on +z.
std::vector<Light> key_and_fill_lights();

/// key_and_fill_lights() in the camera's axes: a white Lambertian surface that faces the camera has a
/// radiance of about 1 / pi.
std::vector<Light> default_lights(const Camera& camera);

}  // namespace selvedge
