#include "viewer/light/floor.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <numbers>

using namespace selvedge;

TEST_CASE("a floor is as dark under a plate as the plate's form factor says, and not beyond the grid") {
  // A square plate of 2 x 2 m at 0.5 m over the floor, whose height a speck gives.
  MergedSurfaces mesh;
  mesh.positions = {{-1, 0.5F, -1},       {1, 0.5F, -1},    {1, 0.5F, 1}, {-1, 0.5F, 1},
                    {0.99F, 0.0F, 0.99F}, {1, 0.0F, 0.99F}, {1, 0, 1}};
  for (const auto& corners : {std::array{0U, 1U, 2U}, std::array{0U, 2U, 3U}, std::array{4U, 5U, 6U}})
    mesh.triangles.push_back({corners});
  const Floor floor = find_floor(mesh);
  CHECK(floor.height == 0);
  CHECK(floor.width == 4);
  const double x = 1 / 0.5;
  const double root = std::sqrt(1 + x * x);
  const double factor = 4 * x / root * std::atan(x / root) / std::numbers::pi;
  CHECK(static_cast<double>(floor.hidden_fraction_at(0, 0)) == doctest::Approx(0.6 * factor).epsilon(0.02));
  CHECK(floor.hidden_fraction_at(-1, 0) < 0.6 * floor.hidden_fraction_at(0, 0));
  CHECK(floor.hidden_fraction_at(-2, 0) == 0);
  CHECK(floor.hidden_fraction_at(50, 0) == 0);

  // From above it is seen around and through what is drawn, from below it is not.
  Camera camera;
  camera.position = {0, 2, 0};
  camera.up = {0, 0, -1};
  Frame frame{3, 3, std::vector<V4f>(9, V4f(0))};
  frame.pixels[0] = V4f(0.25F, 0.5F, 0.5F, 1);
  frame.pixels[4] = V4f(0.25F, 0.25F, 0.25F, 0.5F);
  add_floor(floor, camera, V3d(0, 0, 0), frame);
  CHECK(frame.pixels[0] == V4f(0.25F, 0.5F, 0.5F, 1));
  CHECK(frame.pixels[4].x == 0.25F);
  CHECK(frame.pixels[4].w == doctest::Approx(0.5F + 0.5F * floor.hidden_fraction_at(0, 0)));
  CHECK(frame.pixels[5].w > 0);
  camera.position = {0, -2, 0};
  Frame below{3, 3, std::vector<V4f>(9, V4f(0))};
  add_floor(floor, camera, V3d(0, 0, 0), below);
  CHECK(below.pixels[4].w == 0);
  CHECK(find_floor({}).hidden_fraction.empty());
}
