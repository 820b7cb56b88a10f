#include "viewer/orbit.h"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "tests/require.h"
#include "tests/viewer/shapes.h"
#include "viewer/show/state.h"

namespace selvedge {
namespace {

const std::vector<V3d> cube = box_corners(std::vector<V3d>{V3d(-1, -2, -3), V3d(1, 2, 3), V3d(0, 0, 0)});
constexpr double aspect = 1.5;

CameraOptions started(CameraOptions options = {}) { return test::need(start_orbit(cube, aspect, options)); }

Camera camera_of(const CameraOptions& orbit) { return test::need(make_camera(cube, aspect, orbit)); }

/// Where a point is seen, in [-1, 1]^2.
V2d seen_at(const Camera& camera, const V3d& point) {
  const M44d clip = clip_matrix(camera, V3d(0, 0, 0));
  V3d result;
  clip.multVecMatrix(point, result);
  return {result.x, result.y};
}

TEST_CASE("an orbit begins at the middle of the points and shows all of them") {
  for (const Projection projection : {Projection::perspective, Projection::parallel}) {
    CameraOptions options;
    options.projection = projection;
    options.azimuth = 40;
    options.elevation = 20;
    const CameraOptions orbit = started(options);
    CHECK(*orbit.look_at == V3d(0, 0, 0));
    double farthest = 0;
    for (const V3d& corner : cube) {
      const V2d at = seen_at(camera_of(orbit), corner);
      farthest = std::max({farthest, std::abs(at.x), std::abs(at.y)});
    }
    CHECK(farthest <= 1);
    CHECK(farthest > 0.9);
  }
}

TEST_CASE("a drag over the height of the window is half a turn, and the top is not passed") {
  CameraOptions orbit = started();
  turn(orbit, V2d(0.25, 0.1));
  CHECK(orbit.azimuth == doctest::Approx(-45));
  CHECK(orbit.elevation == doctest::Approx(-18));
  turn(orbit, V2d(-2.25, 3));
  CHECK(orbit.azimuth == doctest::Approx(0));
  CHECK(orbit.elevation == -90);
}

TEST_CASE("what is dragged follows the hand: near points in a turn, the orbit's point in a pan") {
  CameraOptions orbit = started();
  const V3d near_side(0, 0, 3);
  const V2d before = seen_at(camera_of(orbit), near_side);
  CameraOptions turned = orbit;
  turn(turned, V2d(0.05, 0.05));
  const V2d after = seen_at(camera_of(turned), near_side);
  CHECK(after.x > before.x);
  CHECK(after.y > before.y);
  const V3d middle = *orbit.look_at;
  pan(orbit, V2d(0.2, -0.1));
  const V2d moved = seen_at(camera_of(orbit), middle);
  // Window heights to [-1, 1]^2.
  CHECK(moved.x == doctest::Approx(2 * 0.2 / aspect));
  CHECK(moved.y == doctest::Approx(2 * -0.1));
}

TEST_CASE("the wheel nears by a tenth and keeps what lies under the cursor at the orbit's distance") {
  CameraOptions orbit = started();
  const double distance = *orbit.distance;
  const V2d cursor(0.5, -0.25);
  const Camera camera = camera_of(orbit);
  const V3d under = *orbit.look_at + (camera.right * (cursor.x * camera.window_half_size.x) +
                                      camera.up * (cursor.y * camera.window_half_size.y)) *
                                         distance;
  dolly(orbit, 1, cursor, aspect, 7);
  CHECK(*orbit.distance == doctest::Approx(0.9 * distance));
  const V2d at = seen_at(camera_of(orbit), under);
  CHECK(at.x == doctest::Approx(cursor.x));
  CHECK(at.y == doctest::Approx(cursor.y));
  dolly(orbit, -1, cursor, aspect, 7);
  CHECK((*orbit.look_at).length() < 1e-9);
  dolly(orbit, 1e4, V2d(0, 0), aspect, 7);
  CHECK(*orbit.distance == doctest::Approx(7e-4));
}

TEST_CASE("steps towards what is seen never pass it, and the camera does not jump") {
  CameraOptions orbit = started();
  orbit.azimuth = 30;
  const Camera before = camera_of(orbit);
  const V3d seen = before.position - before.image_normal() * 2.0 + before.right * 0.1;
  orbit_about(orbit, seen);
  CHECK((camera_of(orbit).position - before.position).length() < 1e-9);
  CHECK(*orbit.distance == doctest::Approx(2));
  for (int i = 0; i < 200; ++i) dolly(orbit, 1, V2d(0, 0), aspect, 1e-9);
  const Camera near = camera_of(orbit);
  CHECK((near.position - seen).dot(near.image_normal()) > 0);
  const CameraOptions kept = orbit;
  orbit_about(orbit, near.position + near.image_normal());
  CHECK(*orbit.distance == *kept.distance);
}

TEST_CASE("a light is dragged as if it hung on a sphere") {
  const V3d right = turn_light(V3d(0, 0, 1), V2d(0.5, 0));
  CHECK((right - V3d(1, 0, 0)).length() < 1e-12);
  const V3d up = turn_light(V3d(0, 0, 1), V2d(0, 0.25));
  CHECK((up - V3d(0, std::sqrt(0.5), std::sqrt(0.5))).length() < 1e-12);
}

TEST_CASE("lights told in other axes are the same lights") {
  ShowState state;
  state.camera = started();
  state.camera.azimuth = 70;
  state.camera.elevation = 30;
  const Camera camera = camera_of(state.camera);
  state.lights = default_lights(Camera{});
  const std::vector<Light> before = lights_in_world(state, camera);
  switch_light_frame(state);
  CHECK_FALSE(state.lights_in_camera_frame);
  const std::vector<Light> after = lights_in_world(state, camera);
  for (std::size_t i = 0; i < before.size(); ++i)
    CHECK((before[i].direction - after[i].direction).length() < 1e-12);
  // A drag means the same in both.
  ShowState other = state;
  switch_light_frame(other);
  for (ShowState* each : {&state, &other}) {
    const ShowInput drag{ShowInput::Grip::light, V2d(0.1, 0.2), 0, V2d(0, 0)};
    CHECK(apply(drag, aspect, 7, *each) == Redraw::frame);
  }
  CHECK((lights_in_world(state, camera)[0].direction - lights_in_world(other, camera)[0].direction).length() <
        1e-12);
}

TEST_CASE("a light that stands in the scene is not turned, and knows no axes of a camera") {
  ShowState state;
  state.camera = started();
  state.camera.azimuth = 70;
  const Camera camera = camera_of(state.camera);
  Light lamp;
  lamp.kind = LightKind::spot;
  lamp.position = V3d(1, 2, 3);
  lamp.direction = V3d(0, 1, 0);
  state.lights = {lamp};
  turn_dragged_light(V2d(0.1, 0.2), camera, state);
  switch_light_frame(state);
  for (const bool in_camera_frame : {true, false}) {
    state.lights_in_camera_frame = in_camera_frame;
    const Light after = lights_in_world(state, camera)[0];
    CHECK(after.position == lamp.position);
    CHECK(after.direction == lamp.direction);
  }
}

TEST_CASE("a moving picture is as large as its time allows, and steady") {
  FramePace pace;
  CHECK(pace.size_divisor() == 4);
  const auto draw = [&](double full_seconds, int frames) {
    for (int i = 0; i < frames; ++i)
      pace.add_frame(full_seconds / (pace.size_divisor() * pace.size_divisor()), 0.05);
    return pace.size_divisor();
  };
  CHECK(draw(0.01, 20) == 1);
  CHECK(draw(1, 1) == 1);  // a single slow frame
  const double slow = draw(0.2, 20);
  CHECK(slow >= 2);
  CHECK(slow < 2.6);
  CHECK(draw(0.2 / 1.2, 20) == slow);
  CHECK(draw(100, 20) == 4);
}

TEST_CASE("a turntable keeps its distance and shows everything all the way round") {
  CameraOptions options;
  options.elevation = 15;
  options.azimuth = 10;
  std::vector<Camera> cameras;
  for (const CameraOptions& view : test::need(turntable(cube, aspect, options, 12, true)))
    cameras.push_back(test::need(make_camera(cube, aspect, view)));
  REQUIRE(cameras.size() == 13);
  CHECK(cameras.back().image_normal().y == doctest::Approx(1));
  for (const Camera& camera : cameras) {
    CHECK(camera.position.length() == doctest::Approx(cameras.front().position.length()));
    for (const V3d& corner : cube) {
      const V2d at = seen_at(camera, corner);
      CHECK(std::max(std::abs(at.x), std::abs(at.y)) <= 1);
    }
  }
  // A quarter of the way.
  CHECK(cameras[3].right.dot(cameras[0].right) == doctest::Approx(0).epsilon(1e-9));
  CHECK(cameras[3].position.dot(cameras[0].right) > 0);
}

TEST_CASE("a turntable with its camera inside of the garment is refused") {
  CameraOptions options;
  options.distance = 0.5;
  CHECK(test::error_of(turntable(cube, aspect, options, 12)).place == "--distance");
}

}  // namespace
}  // namespace selvedge
