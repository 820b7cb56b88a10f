#include "format/scene/camera.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "format/base/random.h"
#include "tests/require.h"

namespace selvedge {
namespace {

std::vector<V3d> cloud() {
  std::vector<V3d> points;
  Random random(4);
  const auto number = [&] { return random.uniform() * 2 - 1; };
  for (int i = 0; i < 50; ++i) points.emplace_back(number() * 3 + 5, number(), number() * 2);
  return points;
}

V3d to_image(const Camera& camera, const V3d& p) {
  V3d result;
  clip_matrix(camera, V3d(0, 0, 0)).multVecMatrix(p, result);
  return result;
}

TEST_CASE("the camera shows all points, and fills the frame") {
  for (const Projection projection : {Projection::perspective, Projection::parallel}) {
    for (const double elevation : {-90.0, -20.0, 0.0, 35.0, 90.0}) {
      for (const double aspect : {0.5, 1.0, 1.8}) {
        CameraOptions options{.projection = projection, .azimuth = 70, .elevation = elevation};
        const Camera camera = test::need(make_camera(cloud(), aspect, options));
        double reach = 0;
        for (const V3d& p : cloud()) {
          const V3d q = to_image(camera, p);
          reach = std::max({reach, std::abs(q.x), std::abs(q.y)});
          CHECK(std::abs(q.z) < 1);
        }
        CHECK(reach < 1);
        // The margin is 5 % of the distance.
        CHECK(reach > 0.9);
      }
    }
  }
}

TEST_CASE("the view direction at a pixel points from the surface to the viewer") {
  CameraOptions options{.azimuth = 20, .elevation = 30, .zoom = 2, .zoom_centre = V2d(0.3, 0.6)};
  const Camera camera = test::need(make_camera(cloud(), 1.5, options));
  for (const V3d& p : cloud()) {
    const V3d q = to_image(camera, p);
    const V3d expected = (camera.position - p).normalized();
    CHECK((view_direction(camera, V2d(q.x, q.y)) - expected).length() < 1e-12);
  }
}

TEST_CASE("an oblique parallel camera shows its image plane undistorted") {
  Camera camera{.projection = Projection::parallel,
                .position = V3d(1, 2, 3),
                .to_viewer = V3d(0.8, -0.3, 0.4).normalized(),
                .window_half_size = V2d(2, 5),
                .near = -10,
                .far = 10};
  const V3d q = to_image(camera, V3d(1 + 1, 2 - 2.5, 3));
  CHECK(q.x == doctest::Approx(0.5));
  CHECK(q.y == doctest::Approx(-0.5));
  // Two points on one line of sight fall on the same pixel, the nearer one with the smaller depth.
  const V3d nearer = to_image(camera, V3d(2, -0.5, 3) + camera.to_viewer);
  CHECK(nearer.x == doctest::Approx(q.x));
  CHECK(nearer.y == doctest::Approx(q.y));
  CHECK(nearer.z < q.z);
}

TEST_CASE("zoom enlarges around the focus") {
  CameraOptions options;
  const Camera wide = test::need(make_camera(cloud(), 1.5, options));
  options.zoom = 4;
  options.zoom_centre = V2d(0.75, 0.25);
  const Camera close = test::need(make_camera(cloud(), 1.5, options));
  for (const V3d& p : cloud()) {
    const V3d a = to_image(wide, p);
    const V3d b = to_image(close, p);
    CHECK(b.x == doctest::Approx(4 * (a.x - 0.5)));
    CHECK(b.y == doctest::Approx(4 * (a.y - 0.5)));
  }
}

TEST_CASE("look-at puts its point into the middle at the given distance") {
  CameraOptions options{.azimuth = 33, .elevation = 12, .look_at = V3d(4, 0.5, 1), .distance = 2.5};
  const Camera camera = test::need(make_camera(cloud(), 1, options));
  const V3d q = to_image(camera, V3d(4, 0.5, 1));
  CHECK(std::abs(q.x) < 1e-12);
  CHECK(std::abs(q.y) < 1e-12);
  CHECK((camera.position - V3d(4, 0.5, 1)).length() == doctest::Approx(2.5));
}

TEST_CASE("azimuth 90 looks from +x and elevation 90 from above") {
  CameraOptions options{.azimuth = 90};
  CHECK(make_camera(cloud(), 1, options)->image_normal().x == doctest::Approx(1));
  options.elevation = 90;
  CHECK(make_camera(cloud(), 1, options)->image_normal().y == doctest::Approx(1));
}

TEST_CASE("a single point can be looked at") {
  const std::vector<V3d> point{V3d(1, 2, 3)};
  for (const Projection projection : {Projection::perspective, Projection::parallel}) {
    CameraOptions options{.projection = projection};
    const Camera camera = test::need(make_camera(point, 1, options));
    const V3d q = to_image(camera, point[0]);
    CHECK(std::abs(q.x) < 1e-6);
    CHECK(std::abs(q.y) < 1e-6);
    CHECK(std::abs(q.z) <= 1);
  }
}

TEST_CASE("options out of range are refused by name") {
  const auto place_of = [](auto change) {
    CameraOptions options;
    change(options);
    const Error error = test::error_of(make_camera(cloud(), 1, options));
    CHECK(error.code == Code::option_out_of_range);
    return error.place;
  };
  CHECK(place_of([](CameraOptions& o) { o.field_of_view = 180; }) == "--fov");
  CHECK(place_of([](CameraOptions& o) { o.elevation = 91; }) == "--elevation");
  CHECK(place_of([](CameraOptions& o) { o.zoom = 0; }) == "--zoom");
  CHECK(place_of([](CameraOptions& o) { o.distance = -1; }) == "--distance");
}

/// A camera of a file at (1, 2, 3) that looks along -x.
SceneCamera camera_in_file() {
  SceneCamera camera;
  camera.name = "side";
  camera.yfov = std::numbers::pi / 2;
  camera.znear = 0.5;
  camera.world.setScale(V3d(2, 3, 4));
  camera.world *= M44d().rotate(V3d(0, std::numbers::pi / 2, 0));
  camera.world *= M44d().setTranslation(V3d(1, 2, 3));
  return camera;
}

TEST_CASE("a camera of the file stands where its node is, whatever its scale") {
  Scene scene;
  scene.cameras = {camera_in_file()};
  const std::vector<V3d> points{V3d(-9, 0, 0), V3d(0, 0, 0)};
  for (const char* wanted : {"side", "0"}) {
    const Camera camera = test::need(find_scene_camera(scene, wanted, points, 2, {}));
    CHECK((camera.position - V3d(1, 2, 3)).length() < 1e-12);
    CHECK((camera.image_normal() - V3d(1, 0, 0)).length() < 1e-12);
    CHECK((camera.up - V3d(0, 1, 0)).length() < 1e-12);
    CHECK(camera.near == 0.5);
    CHECK(camera.far > 10);
    // 90 degrees from bottom to top: the point one before and one above it is on the upper edge.
    const V3d edge = V3d(0, 3, 3) * clip_matrix(camera, V3d(0, 0, 0));
    CHECK(edge.y == doctest::Approx(1));
    CHECK(edge.x == doctest::Approx(0));
  }
}

TEST_CASE("what a camera of the file shows in its own frame is seen whole in another") {
  Scene scene;
  SceneCamera narrow = camera_in_file();
  narrow.aspect = 3;
  SceneCamera flat = camera_in_file();
  flat.is_perspective = false;
  flat.half_size = V2d(4, 1);
  flat.zfar = 20;
  scene.cameras = {narrow, flat};
  const std::vector<V3d> points{V3d(-9, 0, 0)};
  CHECK(find_scene_camera(scene, "0", points, 1.5, {})->window_half_size.y == doctest::Approx(2));
  CHECK(find_scene_camera(scene, "0", points, 4, {})->window_half_size.y == doctest::Approx(1));
  const Result<Camera> parallel = find_scene_camera(scene, "1", points, 2, {});
  CHECK(parallel->projection == Projection::parallel);
  CHECK(parallel->window_half_size == V2d(4, 2));
  CHECK(parallel->far == 20);
}

TEST_CASE("a camera that the scene does not have is refused with those that it has") {
  Scene scene;
  scene.cameras = {camera_in_file()};
  const Error error = test::error_of(find_scene_camera(scene, "top", std::vector<V3d>{V3d(0, 0, 0)}, 1, {}));
  CHECK(error.code == Code::option_out_of_range);
  CHECK(error.place == "--camera");
  CHECK(error.message.find("0 \"side\"") != std::string::npos);
}

}  // namespace
}  // namespace selvedge
