#include "format/scene/framing.h"

#include <doctest/doctest.h>

#include <string>

#include "tests/require.h"
#include "tests/viewer/shapes.h"

namespace selvedge {
namespace {

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
