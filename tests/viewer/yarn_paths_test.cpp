// The yarn itself, drawn by every path, beside rays through it.
#include "format/fabric/yarns.h"

#include <doctest/doctest.h>

#include "format/scene/swatch.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"
#include "tests/viewer/paths.h"
#include "tests/viewer/rays.h"
#include "tests/viewer/shapes.h"
#include "viewer/renderer.h"

namespace selvedge {
namespace {

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

/// dB of a picture of a swatch against rays, from `away` repeats beside.
double decibels_of(const Fabric& fabric, SwatchView view, double away, int level) {
  SwatchShot shot = swatch_shot(view, V2d(fabric.period_mm), 96, 72);
  shot.camera.position += V3d(away, 0, 0) * static_cast<double>(fabric.period_mm.x) * 1e-3;
  const Scene scene = swatch_scene(V2d(fabric.period_mm), shot);
  RenderOptions options;
  options.context = ContextKind::osmesa;
  options.width = shot.width;
  options.height = shot.height;
  options.layers = 1;
  options.lights = shot.lights;
  const Frame frame = test::need(render(scene, {fabric}, shot.camera, options));
  const Frame rays =
      test::march(scene, {&fabric, 1}, shot.camera, {shot.width, shot.height}, shot.lights, 0, 1, level);
  return test::decibels(frame, rays, 1);
}

}  // namespace

TEST_CASE("cell images show the yarn that rays meet, from every place, of any size") {
  struct Case {
    const char* name;
    Fabric fabric;
    SwatchView view;
    double db;
  };
  // Rays of one repeat are taken as parallel, and these stand as high above each other as they are wide.
  for (const Case& example : {Case{"yarn and plies", fabric_of(3, 4), SwatchView::near, 28},
                              Case{"yarn and plies", fabric_of(3, 4), SwatchView::middle, 23},
                              Case{"yarn and plies", fabric_of(3, 4), SwatchView::grazing, 25},
                              Case{"strands", fabric_of(3, 4, true), SwatchView::near, 28},
                              Case{"strands", fabric_of(3, 4, true), SwatchView::middle, 23},
                              Case{"one yarn", fabric_of(3, 1), SwatchView::near, 33},
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
