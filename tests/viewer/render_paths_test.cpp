// Frames beside rays: the viewer looks fabrics up in cell images, of one view and light for a patch of
// repeats, rays evaluate each texel. Fabrics here are noise, which shows all differences.
#include <doctest/doctest.h>

#include <cmath>

#include "tests/format/fabrics.h"
#include "tests/require.h"
#include "tests/shared_data.h"
#include "tests/viewer/paths.h"
#include "viewer/renderer.h"

namespace selvedge {
namespace {

test::Setting sphere_in(const Fabric& fabric) {
  test::Setting setting;
  test::add(setting.scene, test::sphere(64, 32, V2d(12, 6)), test::material(0));
  setting.fabrics.push_back(fabric);
  setting.options.width = 300;
  setting.options.height = 200;
  setting.camera.elevation = 20;
  setting.options.lights = {{V3d(0.48, 0.6, 0.64), V3f(3, 2, 1)}, {V3d(-0.6, 0, 0.8), V3f(0.5F, 0.5F, 1)}};
  return setting;
}

}  // namespace

TEST_CASE("hybrid and rays agree on lobes, table, holes, front and back") {
  test::Setting setting = sphere_in(test::random_fabric(16, 16, 1));
  CHECK(test::decibels_to_rays(setting) > 30);
  setting.options.levels.forced_level = 1;
  setting.options.layers = 1;
  CHECK(test::decibels_to_rays(setting) > 30);
}

TEST_CASE("hybrid and rays agree on light tables and products") {
  CHECK(test::decibels_to_rays(sphere_in(test::random_product_fabric(16, 16, {4, 4}, 1, 3))) > 27);
}

TEST_CASE("a point light over a Lambertian square has the radiance of its closed form") {
  test::Setting setting;
  test::add(setting.scene, test::square(1, 0), test::material(0));
  setting.fabrics.push_back(test::lambert_fabric(1, V3f(0.5F)));
  setting.options.width = setting.options.height = 64;
  setting.camera.projection = Projection::parallel;
  Light point;
  point.kind = LightKind::point;
  point.position = V3d(0.2, 0.1, 0.7);
  point.irradiance = V3f(2);
  setting.options.lights = {point};
  const auto points = test::need(world_points(setting.scene));
  const auto camera = test::need(make_camera(points, 1, setting.camera));
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
    const Frame frame = test::drawn(setting, path);
    for (int y = 8; y < 56; y += 9) {
      for (int x = 8; x < 56; x += 9) {
        const V2d s((2.0 * x + 1) / 64 - 1, 1 - (2.0 * y + 1) / 64);
        const V2d at = camera.window_centre + s * camera.window_half_size;
        const V3d p = camera.position + camera.right * at.x + camera.up * at.y;
        const V3d towards = point.position - V3d(p.x, p.y, 0);
        const double expected = 0.5 / 3.14159265358979 * 2 * towards.z / std::pow(towards.length2(), 1.5);
        CHECK(frame.pixels[y * 64 + x].x == doctest::Approx(expected).epsilon(1e-3));
      }
    }
  }
}

TEST_CASE("hybrid and rays agree on surfaces with and without fabric, one behind the other") {
  test::Setting setting;
  Fabric holes = test::lambert_fabric(8, V3f(0.8F, 0.5F, 0.2F), 0.5F);
  holes.radiance_scale = 0.5F;
  test::add(setting.scene, test::square(3, 0.2F), test::material(0));
  test::add(setting.scene, test::square(2, 0.1F), test::material(-1, V4f(0.2F, 0.4F, 0.9F, 1)));
  test::add(setting.scene, test::square(1, 0), test::material(1));
  setting.fabrics = {holes, test::random_fabric(8, 4, 5)};
  setting.options.width = 160;
  setting.options.height = 120;
  setting.camera.azimuth = 25;
  setting.options.lights = {{V3d(0.48, 0.6, 0.64), V3f(2)}};
  CHECK(test::decibels_to_rays(setting) > 30);
}

TEST_CASE("EGL without a surface finds the triangles that OSMesa finds") {
  test::Setting setting = sphere_in(test::random_fabric(16, 16, 1));
  const Frame frame = test::drawn(setting, RenderPath::hybrid);
  RenderOptions options = setting.options;
  options.context = ContextKind::egl;
  const auto other = render(setting.scene, setting.fabrics, test::camera_of(setting), options);
  if (!other) {
    CHECK(other.error().code == Code::graphics_unavailable);
    test::skip(to_line(other.error()));
    return;
  }
  CHECK(test::decibels(*other, frame, 1) > 60);
}

TEST_CASE(
    "the processor finds the triangles that OpenGL finds: through many holes, inside cloth, behind the "
    "viewer") {
  struct Case {
    int spheres;
    CameraOptions camera;
  };
  CameraOptions within;
  within.look_at = V3d(0, 0.3, -0.2);
  within.distance = 0.9;
  within.field_of_view = 100;
  CameraOptions apart;
  apart.azimuth = 35;
  apart.elevation = -70;
  apart.zoom = 0.02;
  CameraOptions near;
  near.zoom = 40;
  near.azimuth = 190;
  CameraOptions parallel;
  parallel.projection = Projection::parallel;
  // Edges of quads lie on centres of pixels.
  parallel.azimuth = 45;
  for (const Case& example :
       {Case{4, {}}, Case{4, within}, Case{1, apart}, Case{2, near}, Case{3, parallel}}) {
    test::Setting setting = sphere_in(test::random_fabric(16, 16, 1));
    for (int i = 1; i < example.spheres; ++i)
      test::add(setting.scene, test::sphere(24 + i, 12, V2d(12, 6)), test::material(0),
                M44d().setScale(1 - 0.15 * i) * M44d().setTranslation(V3d(0.1 * i, 0, 0)));
    setting.camera = example.camera;
    const Frame frame = test::drawn(setting, RenderPath::raster);
    const Frame other = test::drawn(setting, RenderPath::hybrid);
    std::size_t apart_count = 0;
    for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
      const V4f difference = frame.pixels[i] - other.pixels[i];
      if (!(difference.length() < 0.05F)) ++apart_count;
    }
    CAPTURE(example.spheres);
    CHECK(apart_count <= frame.pixels.size() / 1000);
  }
}

}  // namespace selvedge
