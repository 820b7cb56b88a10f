#include "format/scene/camera.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "format/base/random.h"
#include "format/scene/framing.h"
#include "tests/require.h"
#include "tests/viewer/shapes.h"

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

M44d moved(const V3d& by, double scale = 1) {
  return M44d().setScale(V3d(scale)) * M44d().setTranslation(by);
}

const M44d upright;

/// Turns +z to +y.
M44d lying() { return M44d(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1); }

TEST_CASE("the frame holds the cloth and what is beside it, and names strays") {
  struct Part {
    bool cloth;
    V3d at;
    double size;
  };
  struct Case {
    std::string name;
    std::vector<Part> parts;
    std::size_t points;
    std::size_t strays;
    bool left_out;
  };
  for (const Case& example : {
           Case{"cloth", {{true, {0, 0, 0}, 1}}, 4, 0, false},
           Case{"nothing is cloth", {{false, {0, 0, 0}, 1}, {false, {1, 0, 0}, 1}}, 8, 0, false},
           Case{"a button far away", {{false, {0, 107, 0}, 0.01}, {true, {0, 0, 0}, 0.3}}, 4, 1, true},
           Case{
               "a scrap of cloth far away", {{true, {0, 0, -107}, 0.01}, {true, {0, 0, 0}, 0.3}}, 4, 1, true},
           Case{"a scrap of no cloth far away",
                {{false, {107, 0, 0}, 0.01}, {false, {0, 0, 0}, 0.3}},
                4,
                1,
                true},
           Case{"a button on it", {{true, {0, 0, 0}, 1}, {false, {0.2, 0, 0.1}, 0.01}}, 8, 0, false},
           Case{"a wall behind it", {{true, {0, 0, 0}, 1}, {false, {0, 0, -1}, 3}}, 4, 0, true},
           Case{"two pieces side by side", {{true, {0, 0, 0}, 1}, {true, {3, 0, 0}, 1}}, 8, 0, false},
       }) {
    INFO(example.name);
    Scene scene;
    for (const Part& part : example.parts)
      test::add(scene, test::square(1), test::material(part.cloth ? 0 : -1), moved(part.at, part.size));
    const Framing framing = test::need(frame_scene(scene));
    CHECK(framing.points.size() == example.points);
    CHECK(framing.stray_remarks.size() == example.strays);
    CHECK(framing.excluded_corners.empty() != example.left_out);
    CHECK(framing.turn_remark.empty());
    Camera camera = test::need(make_camera(framing.points, 1, {}));
    const Camera before = camera;
    widen_clipping_depths(framing.excluded_corners, camera);
    for (const V3d& point : framing.excluded_corners)
      CHECK((camera.position - point).dot(camera.image_normal()) < camera.far);
    if (!example.left_out) CHECK((camera.near == before.near && camera.far == before.far));
  }
}

TEST_CASE("a vertex far away is left out of the frame of its own part") {
  Scene scene;
  ScenePrimitive square = test::square(1);
  for (const V3f& at : {V3f(0, 50, 0), V3f(0, 50.01F, 0), V3f(0.01F, 50, 0)}) {
    square.indices.push_back(static_cast<std::uint32_t>(square.positions.size()));
    square.positions.push_back(at);
  }
  test::add(scene, square, test::material(0));
  const Framing framing = test::need(frame_scene(scene));
  CHECK(framing.points.size() == 4);
  REQUIRE(framing.stray_remarks.size() == 1);
  CHECK(framing.stray_remarks[0].find("square/0") != std::string::npos);
}

TEST_CASE("cloth that the front shows edge-on is seen from its larger side, in front of its normals") {
  const auto turned = [](const M44d& world) {
    Scene scene;
    test::add(scene, test::square(1), test::material(0), world);
    return test::need(frame_scene(scene));
  };
  CHECK(turned(upright).turn_remark.empty());
  const Framing floor = turned(lying());
  CHECK(floor.elevation == doctest::Approx(90));
  CHECK(floor.turn_remark.find("--elevation 90") != std::string::npos);
  CHECK(turned(lying() * M44d().setScale(V3d(1, -1, -1))).elevation == doctest::Approx(-90));
  // Turned about the y axis, so that +z becomes +x.
  const Framing wall = turned(M44d(0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1));
  CHECK(wall.azimuth == doctest::Approx(90));
  CHECK(wall.elevation == doctest::Approx(0));
}

TEST_CASE("a garment is seen from its broad side, and from the front of VRM 0") {
  const M44d half = M44d().setScale(V3d(0.5, 1, 1));
  const M44d back = M44d().setScale(V3d(-1, 1, -1));
  const M44d right(0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1);
  struct Case {
    std::vector<M44d> squares;
    double front, azimuth, elevation;
  };
  for (const Case& c : {Case{{upright, upright * back}, 0, 0, 0},
                        {{right, right * back}, 0, 90, 0},
                        {{half, half * back, right, right * back}, 0, 90, 0},
                        {{upright, upright * back, right, right * back}, 0, 0, 0},
                        {{lying(), lying() * M44d().setScale(V3d(1, -1, -1))}, 0, 0, 90},
                        {{upright, upright * back}, 180, 180, 0}}) {
    Scene scene;
    scene.front_azimuth = c.front;
    for (const M44d& square : c.squares) test::add(scene, test::square(1), test::material(0), square);
    const Framing framing = test::need(frame_scene(scene));
    CHECK(framing.azimuth == doctest::Approx(c.azimuth));
    CHECK(framing.elevation == doctest::Approx(c.elevation));
    CHECK(framing.turn_remark.empty() == (c.azimuth == 0 && c.elevation == 0));
  }
}

}  // namespace
}  // namespace selvedge
