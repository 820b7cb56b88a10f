// Scenes at the edge of what can be asked, on both paths (docs/extremes.md).
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "format/base/parallel.h"
#include "tests/format/fabrics.h"
#include "tests/format/yarn_data.h"
#include "tests/require.h"
#include "tests/viewer/shapes.h"
#include "viewer/renderer.h"
#include "viewer/scene/surfaces.h"

namespace selvedge {
namespace {

constexpr float albedo = 0.5F;
constexpr float facing_radiance = albedo / std::numbers::pi_v<float>;

struct Extreme {
  Scene scene;
  std::vector<Fabric> fabrics;
  Camera camera;
  RenderOptions options;
};

/// Parallel, looking along -z at a window of 2 x 2 m.
Camera facing_camera() {
  Camera camera;
  camera.projection = Projection::parallel;
  camera.position = V3d(0, 0, 0);
  camera.near = -10;
  camera.far = 10;
  return camera;
}

Extreme facing_square(const Fabric& fabric, double repeats) {
  Extreme extreme;
  test::add(extreme.scene, test::square(repeats), test::material(0));
  extreme.fabrics.push_back(fabric);
  extreme.camera = facing_camera();
  extreme.options.width = extreme.options.height = 64;
  extreme.options.lights = {Light{}};
  return extreme;
}

/// The frame by one path; every number of it finite, radiance not below 0, opacity within [0, 1].
Frame drawn(const Extreme& extreme, RenderPath path, RenderStats* stats = nullptr) {
  RenderOptions options = extreme.options;
  options.path = path;
  options.context = ContextKind::osmesa;
  const Frame frame = test::need(render(extreme.scene, extreme.fabrics, extreme.camera, options, stats));
  int wrong = 0;
  for (const V4f& p : frame.pixels) {
    for (int c = 0; c < 4; ++c) wrong += std::isfinite(p[c]) && p[c] >= 0 ? 0 : 1;
    wrong += p.w <= 1 ? 0 : 1;
  }
  CHECK(wrong == 0);
  return frame;
}

void on_both_paths(const Extreme& extreme, const std::function<void(const Frame&)>& check) {
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
    CAPTURE(path_names[static_cast<std::size_t>(path)]);
    check(drawn(extreme, path));
  }
}

int covered(const Frame& frame) {
  return static_cast<int>(
      std::count_if(frame.pixels.begin(), frame.pixels.end(), [](const V4f& p) { return p.w > 0; }));
}

/// Largest difference of radiance, relative to the largest radiance of `b`.
double apart(const Frame& a, const Frame& b) {
  REQUIRE(a.pixels.size() == b.pixels.size());
  double difference = 0;
  double most = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      difference = std::max(difference, std::abs(static_cast<double>(a.pixels[i][c] - b.pixels[i][c])));
      most = std::max(most, static_cast<double>(b.pixels[i][c]));
    }
  }
  REQUIRE(most > 0);
  return difference / most;
}

TEST_CASE(
    "matt cloth shows its albedo and the light's cosine, in one pixel, at 89.99 degrees, in any light") {
  struct Case {
    const char* name;
    Extreme extreme;
    double cosine = 1;
    int covered = 64 * 64;
    bool exactly = true;
    double tolerance = 2.5e-4;  ///< texels of cell images have 11 bits
  };
  const Extreme plain = facing_square(test::lambert_fabric(16, V3f(albedo)), 40);
  std::vector<Case> cases;
  Case& far = cases.emplace_back(Case{"a garment of one pixel", plain, 1, 1});
  far.extreme.camera.window_half_size = V2d(64, 64);
  far.extreme.camera.window_centre = V2d(1, 1);
  for (const int supersample : {1, 16}) {
    Case& one = cases.emplace_back(Case{"a frame of one pixel", plain, 1, 1});
    one.extreme.options.width = one.extreme.options.height = 1;
    one.extreme.options.supersample = supersample;
  }
  Case& grazing = cases.emplace_back(Case{"at 89.99 degrees", plain, 1, 60 * 60, false, 1e-3});
  const double angle = 89.99 * std::numbers::pi / 180;
  grazing.extreme.camera.to_viewer = V3d(0, -std::sin(angle), std::cos(angle));
  grazing.extreme.camera.up = V3d(0, std::cos(angle), std::sin(angle));
  grazing.extreme.camera.window_half_size = V2d(1, std::cos(angle));
  grazing.extreme.camera.near = -1000;
  grazing.extreme.camera.far = 1000;
  for (const V3d& direction :
       {V3d(0, 0, 1), V3d(0, 0, -1), V3d(1, 0, 0), V3d(std::sin(1.57), 0, std::cos(1.57))}) {
    Case& lit = cases.emplace_back(Case{"a light", plain, std::max(direction.z, 0.0)});
    lit.extreme.options.lights[0].direction = direction;
  }
  for (const Case& one : cases) {
    CAPTURE(one.name);
    on_both_paths(one.extreme, [&](const Frame& frame) {
      CHECK(covered(frame) >= one.covered);
      if (one.exactly) CHECK(covered(frame) == one.covered);
      for (const V4f& p : frame.pixels)
        if (p.w > 0) CHECK(p.x == doctest::Approx(facing_radiance * one.cosine).epsilon(one.tolerance));
    });
  }
}

TEST_CASE("ten thousand repeats in 64 pixels are the coarsest level everywhere") {
  Extreme extreme = facing_square(test::random_fabric(16, 16, 1), 10000);
  Extreme coarsest = extreme;
  coarsest.options.levels.forced_level = 4;
  on_both_paths(extreme, [&](const Frame& frame) {
    CHECK(covered(frame) == 64 * 64);
    CHECK(apart(frame, drawn(coarsest, RenderPath::hybrid)) < 2.5e-4);
  });
}

TEST_CASE("a camera inside the cloth, and one in its plane, see what is before them") {
  Extreme extreme;
  test::add(extreme.scene, test::sphere(64, 32, V2d(12, 6)), test::material(0));
  extreme.fabrics.push_back(test::lambert_fabric(8, V3f(albedo)));
  extreme.options.width = extreme.options.height = 48;
  extreme.options.lights = {Light{}};
  extreme.camera.near = 1e-4;
  SUBCASE("in the middle the back is all around") {
    extreme.camera.position = V3d(0, 0, 0);
    on_both_paths(extreme, [](const Frame& frame) { CHECK(covered(frame) == 48 * 48); });
  }
  SUBCASE("on the surface") {
    extreme.camera.position = V3d(0, 0, 1);
    on_both_paths(extreme, [](const Frame& frame) { CHECK(covered(frame) > 0); });
  }
  SUBCASE("a thousandth of a millimetre before it") {
    extreme.camera.position = V3d(0, 0, 1 + 1e-6);
    on_both_paths(extreme, [](const Frame&) {});
  }
}

TEST_CASE(
    "yarn and texels in extreme scenes are finite, within their memory and alike for any number of threads") {
  Fabric yarn = test::random_fabric(16, 16, 1);
  yarn.period_mm = {3, 3};
  yarn.reference_height = 0.6F;
  Fabric crowd = yarn;
  yarn.levels.front().set_yarns(std::make_shared<const Yarns>(test::waves(3, 4, true), yarn.period_mm));
  Random random(2);
  YarnData plied = test::tangle(random, crowd.period_mm, 300);
  for (YarnCurve& curve : plied.curves) curve.plies = {8, 4, 3, 0.5F, {-0.5F, 0.25F, 0.75F}};
  test::need(validate(plied, crowd.period_mm));
  crowd.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(plied), crowd.period_mm));

  struct Case {
    const char* name;
    Extreme extreme;
  };
  std::vector<Case> cases{{"300 yarns of 8 plies", facing_square(crowd, 3)}};
  for (const Fabric& fabric : {yarn, test::random_fabric(16, 16, 1)}) {
    for (const double repeats : {0.2, 1.0, 1e6})
      cases.push_back({"few and many repeats", facing_square(fabric, repeats)});
    Extreme extreme = facing_square(fabric, 3);
    for (const double degrees : {0.5, 5.0}) {
      Case& grazing = cases.emplace_back(Case{"grazing", extreme});
      const double angle = degrees * std::numbers::pi / 180;
      grazing.extreme.camera.to_viewer = V3d(0, -std::cos(angle), std::sin(angle));
      grazing.extreme.camera.up = V3d(0, std::sin(angle), std::cos(angle));
      grazing.extreme.camera.window_half_size = V2d(1, std::sin(angle));
    }
    for (const V2d& scale : {V2d(-1, 1), V2d(20, 1), V2d(-1e6)}) {
      Case& moved = cases.emplace_back(Case{"mirrored, stretched and far away", extreme});
      for (V2d& uv : moved.extreme.scene.primitives[0].tex_coords[0])
        uv = scale.y < 0 ? uv + scale : uv * scale;
    }
    Case& tight = cases.emplace_back(Case{"4 MiB", facing_square(fabric, 40)});
    tight.extreme.options.width = tight.extreme.options.height = 800;
    tight.extreme.options.cells.memory_bytes = std::size_t{4} << 20;
    extreme.scene = {};
    test::add(extreme.scene, test::sphere(64, 32, V2d(12, 6)), test::material(0));
    extreme.camera.projection = Projection::perspective;
    extreme.camera.near = 1e-4;
    for (const double away : {0.0, 1.0, 1 + 1e-6}) {
      extreme.camera.position = V3d(0, 0, away);
      cases.push_back({"inside", extreme});
    }
  }
  for (const Case& one : cases) {
    INFO(one.name);
    for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
      set_thread_limit(1);
      RenderStats stats;
      const Frame alone = drawn(one.extreme, path, &stats);
      set_thread_limit(2);
      CHECK(drawn(one.extreme, path).pixels == alone.pixels);
      CHECK(covered(alone) > 0);
      CHECK(stats.peak_image_bytes > 0);
      CHECK(stats.peak_image_bytes <= static_cast<std::int64_t>(one.extreme.options.cells.memory_bytes));
    }
    set_thread_limit(0);
  }
}

TEST_CASE("the picture follows the light's strength from 1e-6 to 1e9") {
  Extreme extreme = facing_square(test::random_fabric(8, 8, 1), 3);
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
    extreme.options.lights[0].irradiance = V3f(1);
    const Frame plain = drawn(extreme, path);
    for (const float strength : {1e-6F, 1e9F}) {
      extreme.options.lights[0].irradiance = V3f(strength);
      Frame scaled = drawn(extreme, path);
      for (V4f& p : scaled.pixels) p = V4f(p.x / strength, p.y / strength, p.z / strength, p.w);
      CHECK(apart(scaled, plain) < 5e-4);
    }
    // Beyond floats it ends, finite (drawn() looks).
    extreme.options.lights[0].irradiance = V3f(3e38F);
    static_cast<void>(drawn(extreme, path));
  }
}

TEST_CASE("triangles without area change nothing, and one of a kilometre is as flat as a small one") {
  Extreme extreme = facing_square(test::lambert_fabric(8, V3f(albedo)), 3);
  Extreme with = extreme;
  ScenePrimitive& cloth = with.scene.primitives[0];
  cloth.indices.insert(cloth.indices.end(), {0, 0, 0, 0, 1, 1, 2, 3, 2});
  Extreme large = extreme;
  for (V3f& p : large.scene.primitives[0].positions) p *= 500.0F;
  for (V2d& uv : large.scene.primitives[0].tex_coords[0]) uv *= 500.0;
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
    const Frame plain = drawn(extreme, path);
    CHECK(drawn(with, path).pixels == plain.pixels);
    CHECK(apart(drawn(large, path), plain) < 1e-5);
  }
}

TEST_CASE("cloth a million repeats and a million metres away looks as at the origin") {
  const Extreme extreme = facing_square(test::random_fabric(8, 8, 1), 3);
  std::vector<Extreme> cases(4, extreme);
  for (const double away : {1e6, -1e6}) {
    Extreme& far = cases[away > 0 ? 0 : 1];
    for (V2d& uv : far.scene.primitives[0].tex_coords[0]) uv += V2d(away, -away);
    Extreme& moved = cases[away > 0 ? 2 : 3];
    moved.scene.instances[0].world.setTranslation(V3d(away, -away, away));
    moved.camera.position += V3d(away, -away, away);
  }
  for (const RenderPath path : {RenderPath::hybrid, RenderPath::raster}) {
    const Frame plain = drawn(extreme, path);
    for (const Extreme& far : cases) CHECK(apart(drawn(far, path), plain) < 1e-6);
  }
}

}  // namespace
}  // namespace selvedge
