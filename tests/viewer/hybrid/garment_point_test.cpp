#include "viewer/hybrid/garment_point.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "format/base/random.h"
#include "tests/format/fabrics.h"
#include "tests/viewer/frame_scene.h"
#include "tests/viewer/plain_frame.h"

namespace selvedge {
namespace {

TEST_CASE("the garment's frame is orthonormal and faces the viewer whatever was interpolated") {
  Random random(9);
  const auto number = [&] { return static_cast<float>(random.uniform() * 2 - 1); };
  for (int i = 0; i < 1600; ++i) {
    CAPTURE(i);
    const V3f view = V3f(number(), number(), number()).normalized();
    V3f normal(number(), number(), number());
    V3f tangent(number(), number(), number());
    const float handedness = i % 2 == 0 ? 1.0F : -1.0F;
    const float side = i % 3 == 0 ? -1.0F : 1.0F;
    const int kind = i % 8;
    if (kind == 3) normal = {0, 0, 0};
    if (kind == 4) tangent = {0, 0, 0};
    if (kind == 5) normal = {HUGE_VALF, 0, 0};
    if (kind == 6) tangent = {HUGE_VALF, NAN, 0};
    const GarmentFrame frame = garment_frame(normal, tangent, handedness, side, view);
    CHECK(frame.normal.length() == doctest::Approx(1));
    CHECK(frame.tangent.length() == doctest::Approx(1));
    // Where the tangent is nearly the normal little is left of it, and rounding shows.
    CHECK(std::abs(frame.normal.dot(frame.tangent)) < 1e-4F);
    CHECK((frame.normal.cross(frame.tangent) * (side * handedness) - frame.up).length() < 1e-5F);
    CHECK(frame.normal.dot(view) > 0);
    CHECK((frame.to_world(frame.to_frame(view)) - view).length() < 1e-4F);
    if (kind >= 3 && kind <= 6) continue;
    const test::PlainFrame plain = test::plain_frame(
        V3d(normal), V3d(tangent), static_cast<double>(handedness), static_cast<double>(side), V3d(view));
    CHECK((plain.normal - V3d(frame.normal)).length() < 1e-5);
    if (tangent.normalized().cross(frame.normal).length() > 0.1F)
      CHECK((plain.tangent - V3d(frame.tangent)).length() < 1e-4);
  }
}

TEST_CASE("place, texture coordinates and their change agree with a ray through the pixel") {
  const V2i size(120, 90);
  for (const double repeats : {1.0, 7.0, 300.0}) {
    CAPTURE(repeats);
    Scene scene;
    test::add(scene, test::square(repeats), test::material(0));
    test::add(scene, test::sphere(24, 12, V2d(4 * repeats, 2 * repeats)), test::material(0),
              M44d().setScale(0.4));
    CameraOptions options;
    options.elevation = 35;
    options.azimuth = 25;
    options.zoom = 1.7;
    const std::vector<V3d> points{V3d(-1, -1, 0), V3d(1, 1, 0)};
    const Camera camera = test::need(make_camera(points, static_cast<double>(size.x) / size.y, options));
    const test::FrameOf frame(scene, {test::random_fabric(16, 16, 1)}, camera, size);
    const test::RayCaster rays(frame.mesh(), size, camera);
    int pixels = 0;
    double place = 0;
    double coordinates = 0;
    double change = 0;
    frame.each_pixel(3, [&](TriangleSide seen, int x, int y) {
      ++pixels;
      const GarmentPoint point = garment_point(frame.scene(), seen, x, y);
      const auto uv = [&](double right, double up) {
        return rays.uv(seen / 2, x + 0.5 + right, y + 0.5 + up);
      };
      const V2d at = uv(0, 0);
      for (int axis = 0; axis < 2; ++axis) {
        const double apart = at[axis] - static_cast<double>(point.uv[axis]);
        coordinates = std::max(coordinates, std::abs(apart - std::round(apart)));
      }
      constexpr double h = 1e-3;
      const V2d right = (uv(h, 0) - uv(-h, 0)) / (2 * h);
      const V2d up = (uv(0, h) - uv(0, -h)) / (2 * h);
      change = std::max(change, ((right - V2d(point.duv_dx)).length() + (up - V2d(point.duv_dy)).length()) /
                                    (right.length() + up.length()));
      const V3d to_point = (camera.position - V3d(point.position)).normalized();
      place = std::max(place, (to_point - V3d(point.to_viewer)).length());
    });
    CHECK(pixels > 1000);
    CHECK(place < 1e-5);
    CHECK(coordinates < 2e-6 * repeats);
    CHECK(change < 2e-4);
  }
}

TEST_CASE("texture coordinates that overflow are 0") {
  for (const double repeats : {1e30, 3e38}) {
    Scene scene;
    test::add(scene, test::square(repeats), test::material(0));
    const std::vector<V3d> points{V3d(-1, -1, 0), V3d(1, 1, 0)};
    const test::FrameOf frame(scene, {test::random_fabric(8, 8, 1)}, test::need(make_camera(points, 1, {})),
                              {32, 32});
    frame.each_pixel(1, [&](TriangleSide seen, int x, int y) {
      const V2f uv = garment_point(frame.scene(), seen, x, y).uv;
      CHECK((uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1));
    });
  }
}

}  // namespace
}  // namespace selvedge
