// Frames beside rays: the viewer looks fabrics up in cell images, of one view and light for a patch of
// repeats, rays evaluate each texel. Fabrics here are noise, which shows all differences.
#include <doctest/doctest.h>

#include <cmath>

#include "format/fabric/yarns.h"
#include "tests/format/fabrics.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"
#include "tests/shared_data.h"
#include "tests/viewer/paths.h"
#include "tests/viewer/rays.h"
#include "tests/viewer/shapes.h"
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

/// No yarn if there are no curves.
Fabric fabric_of(float period, int curves, bool strands = false) {
  Fabric fabric = test::random_fabric(2, 2, 5);
  fabric.period_mm = {period, period};
  fabric.reference_height = 0.2F * period;
  if (curves > 0)
    fabric.levels.front().set_yarns(
        std::make_shared<const Yarns>(test::waves(period, curves, strands), fabric.period_mm));
  return fabric;
}

/// The four crossings of fabric_of(3, 4), arranged.
Fabric arranged_crossings(const V2i& size, std::vector<std::uint16_t> shown) {
  Fabric fabric = fabric_of(3, 4);
  YarnData data = fabric.levels.front().yarns()->data();
  data.map = {{2, 2}, size, std::move(shown), {1, 0, 0, 1}};
  fabric.period_mm = V2f(size) * 1.5F;
  const V2f period = data.map.yarn_period(fabric.period_mm);
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(data), period));
  return fabric;
}

/// From `away` repeats beside.
double decibels_of(const Fabric& fabric, SwatchView view, double away, int level) {
  SwatchShot shot = swatch_shot(view, V2d(fabric.period_mm), 96, 72);
  shot.camera.position += V3d(away, 0, 0) * static_cast<double>(fabric.period_mm.x) * 1e-3;
  return test::swatch_decibels(fabric, shot, level);
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

TEST_CASE("cell images show the yarn that rays meet, from every place, of any size") {
  struct Case {
    const char* name;
    Fabric fabric;
    SwatchView view;
    double db;
  };
  // Yarn of other crossings does not meet: rays see its ends round.
  const Fabric random = arranged_crossings({2, 3}, {0, 1, 3, 2, 2, 1});
  const Fabric same = arranged_crossings({2, 2}, {0, 1, 2, 3});
  // Rays of one repeat are taken as parallel, and these stand as high above each other as they are wide.
  for (const Case& example : {Case{"yarn and plies", fabric_of(3, 4), SwatchView::near, 28},
                              Case{"yarn and plies", fabric_of(3, 4), SwatchView::middle, 23},
                              Case{"yarn and plies", fabric_of(3, 4), SwatchView::grazing, 25},
                              Case{"strands", fabric_of(3, 4, true), SwatchView::near, 28},
                              Case{"strands", fabric_of(3, 4, true), SwatchView::middle, 23},
                              Case{"one yarn", fabric_of(3, 1), SwatchView::near, 33},
                              Case{"a map of other crossings", random, SwatchView::near, 22},
                              Case{"a map of other crossings", random, SwatchView::middle, 23},
                              Case{"a map of the same", same, SwatchView::near, 28},
                              Case{"a map of the same", same, SwatchView::middle, 23},
                              Case{"0.01 mm", fabric_of(0.01F, 4), SwatchView::near, 28},
                              Case{"10 m", fabric_of(10000, 4), SwatchView::near, 28},
                              Case{"10 m", fabric_of(10000, 4), SwatchView::grazing, 25}}) {
    const double db = decibels_of(example.fabric, example.view, 0, -1);
    MESSAGE(example.name, " ", name_of(example.view), ": ", db);
    CHECK(db > example.db);
  }
}

TEST_CASE("cell images vary beyond the repeat where the reference does, near and far from the origin") {
  Fabric fabric = fabric_of(3, 4);
  YarnData data = fabric.levels.front().yarns()->data();
  for (YarnCurve& curve : data.curves) curve.strands.row_variation = 0.4F;
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(data), fabric.period_mm));
  for (const double away : {0.0, -3e4}) {
    const double db = decibels_of(fabric, SwatchView::far, away, -2);
    MESSAGE(away, " repeats away: ", db);
    CHECK(db > 30);
  }
}

TEST_CASE("the outline of a ball is its yarn's, so deep below the surface as the yarn lies") {
  constexpr float repeats = 40;
  constexpr float period = 3;
  constexpr float radius = 0.3F;
  const float ball = period * repeats / (2 * std::numbers::pi_v<float>);
  const auto width_of = [&](float depth, RenderPath path) {
    test::Setting setting;
    test::add(setting.scene, test::sphere(128, 64, {repeats, repeats / 2}), test::material(0));
    setting.scene.materials[0].alpha_mode = AlphaMode::blend;
    Fabric fabric = fabric_of(period, 0);
    fabric.reference_height = 2 * radius + depth;
    fabric.levels.front().set_yarns(
        std::make_shared<const Yarns>(test::straight(period, radius), fabric.period_mm));
    setting.fabrics = {fabric};
    setting.options.width = setting.options.height = 300;
    setting.options.lights = default_lights(test::camera_of(setting));
    const Frame frame = test::drawn(setting, path);
    // The widest row decides.
    std::ptrdiff_t widest = 0;
    for (int y = 120; y < 180; ++y) {
      const std::span row(&frame.pixels[y * frame.width], frame.width);
      widest = std::max(widest, std::ranges::count_if(row, [](const V4f& p) { return p.w >= 0.5F; }));
    }
    return static_cast<float>(widest);
  };
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
    const float whole = width_of(0, path);
    for (const float depth : {0.5F, 1.0F, 2.0F})
      CHECK(std::abs(width_of(depth, path) - (1 - depth / ball) * whole) < 3.5);
  }
}

}  // namespace selvedge
