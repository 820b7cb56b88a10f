#include "format/scene/lights.h"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>

using namespace selvedge;

TEST_CASE("a light far away is the same everywhere") {
  Light light{.direction = V3d(0, 0.6, 0.8), .irradiance = V3f(2, 3, 4)};
  const Illumination one = illumination_at(light, V3d(100, -7, 3));
  CHECK(one.direction == light.direction);
  CHECK(one.irradiance == light.irradiance);
}

TEST_CASE("a point light falls off with the square of the distance") {
  Light light{.irradiance = V3f(8, 4, 2), .kind = LightKind::point, .position = V3d(1, 2, 3)};
  const Illumination near = illumination_at(light, V3d(1, 2, 4));
  CHECK(near.direction == V3d(0, 0, -1));
  CHECK(near.irradiance == V3f(8, 4, 2));
  const Illumination far = illumination_at(light, V3d(1, 4, 3));
  CHECK(far.direction == V3d(0, -1, 0));
  CHECK(far.irradiance == V3f(2, 1, 0.5F));
  CHECK(illumination_at(light, light.position).irradiance == V3f(0));
}

TEST_CASE("a light's range ends it") {
  Light light{.kind = LightKind::point, .range = 2};
  // The window of KHR_lights_punctual: 1 - (distance / range)^4.
  CHECK(illumination_at(light, V3d(1, 0, 0)).irradiance.x == doctest::Approx(1 - 1.0 / 16));
  CHECK(illumination_at(light, V3d(2, 0, 0)).irradiance == V3f(0));
  CHECK(illumination_at(light, V3d(3, 0, 0)).irradiance == V3f(0));
}

TEST_CASE("a spot light is full within its inner cone and dark outside of the outer one") {
  Light light{.kind = LightKind::spot};
  light.direction = V3d(0, 0, 1);  // it shines along -z
  light.inner_cosine = std::cos(0.2);
  light.outer_cosine = std::cos(0.6);
  const auto at = [&](double angle) {
    return illumination_at(light, V3d(std::sin(angle), 0, -std::cos(angle))).irradiance.x;
  };
  CHECK(at(0) == doctest::Approx(1));
  CHECK(at(0.19) == doctest::Approx(1));
  CHECK(at(0.61) == 0);
  CHECK(at(std::numbers::pi) == 0);
  const double t = (std::cos(0.4) - light.outer_cosine) / (light.inner_cosine - light.outer_cosine);
  CHECK(at(0.4) == doctest::Approx(t * t));
}

TEST_CASE("the lights of a scene shine where its nodes look") {
  Scene scene;
  SceneLight spot;
  spot.kind = LightKind::spot;
  spot.color = V3f(1, 0.5F, 0.25F);
  spot.intensity = 40;
  spot.position = V3d(0, 3, 0);
  spot.direction = V3d(0, -1, 0);
  spot.outer_cone = 0.5;
  scene.lights = {spot};
  const std::vector<Light> lights = scene_lights(scene);
  REQUIRE(lights.size() == 1);
  const Illumination below = illumination_at(lights[0], V3d(0, 1, 0));
  CHECK(below.direction == V3d(0, 1, 0));
  CHECK(below.irradiance == V3f(10, 5, 2.5F));
  CHECK(illumination_at(lights[0], V3d(3, 2, 0)).irradiance == V3f(0));
}
