#include "viewer/renderer.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "tests/require.h"
#include "tests/viewer/small_frames.h"

namespace selvedge {
namespace {

using test::camera_for;
using test::from_the_side;
using test::middle;
using test::render_or_fail;
using test::small;

/// An unlit colour: radiance is the colour over pi.
V4f shown(const V4f& pixel) {
  const float pi = std::numbers::pi_v<float>;
  return {pixel.x * pi, pixel.y * pi, pixel.z * pi, pixel.w};
}

TEST_CASE("through a half transparent cloth half of what lies behind is seen") {
  // The cutoff of MASK is the fallback's alone: a fabric blends all the same.
  for (const AlphaMode mode : {AlphaMode::mask, AlphaMode::blend}) {
    Scene scene;
    SceneMaterial cloth = test::material(0);
    cloth.alpha_mode = mode;
    cloth.alpha_cutoff = 0.9F;
    test::add(scene, test::square(5, 0.5F), cloth);
    test::add(scene, test::square(5, 0), test::material(-1, V4f(0, 1, 0, 1)));
    scene.materials.back().unlit = true;
    const RenderOptions options = small({{V3d(0, 0, 1), V3f(1, 1, 1)}});
    RenderStats stats;
    const Frame frame = render_or_fail(scene, {test::lambert_fabric(4, V3f(1, 0, 0), 0.5F)},
                                       camera_for(scene, options), options, &stats);
    const V4f pixel = middle(frame);
    CHECK(pixel.x == doctest::Approx(0.5 / std::numbers::pi).epsilon(5e-4));
    CHECK(pixel.y == doctest::Approx(0.5 / std::numbers::pi).epsilon(5e-4));
    CHECK(pixel.z == 0);
    CHECK(pixel.w == 1);
    CHECK(stats.layers == 2);
  }
}

TEST_CASE("a material with alpha mode OPAQUE ignores the fabric's opacity") {
  Scene scene;
  SceneMaterial opaque = test::material(0);
  opaque.alpha_mode = AlphaMode::opaque;
  test::add(scene, test::square(5, 0), opaque);
  const RenderOptions options = small({{V3d(0, 0, 1), V3f(1, 1, 1)}});
  const Frame frame = render_or_fail(scene, {test::lambert_fabric(4, V3f(1, 0, 0), 0.5F)},
                                     camera_for(scene, options), options);
  CHECK(middle(frame).x == doctest::Approx(1 / std::numbers::pi).epsilon(5e-4));
  CHECK(middle(frame).w == 1);
}

TEST_CASE("a single-sided fabric is not seen from behind") {
  Scene scene;
  SceneMaterial single = test::material(0);
  single.double_sided = false;
  ScenePrimitive turned = test::square(5, 0);
  std::swap(turned.indices[1], turned.indices[2]);
  std::swap(turned.indices[4], turned.indices[5]);
  test::add(scene, turned, single);
  const RenderOptions options = small({{V3d(0, 0, 1), V3f(1, 1, 1)}});
  const auto middle_of = [&] {
    return middle(
        render_or_fail(scene, {test::lambert_fabric(4, V3f(1, 0, 0))}, camera_for(scene, options), options));
  };
  CHECK(middle_of().w == 0);
  scene.materials[0].double_sided = true;
  CHECK(middle_of().w == 1);
}

TEST_CASE("layers behind each other are shown nearest first, as many as asked for") {
  Scene scene;
  // The order of drawing is not the order in depth.
  for (const float z : {0.0F, 0.4F, -0.4F, 0.8F}) {
    ScenePrimitive p = test::square(1, z);
    test::add(scene, p,
              test::material(
                  -1, V4f(z == 0.8F ? 1.0F : 0.0F, z == 0.4F ? 1.0F : 0.0F, z == 0 ? 1.0F : 0.0F, 0.5F)));
    scene.materials.back().alpha_mode = AlphaMode::blend;
    scene.materials.back().unlit = true;
  }
  RenderOptions options = small({});
  const Camera camera = camera_for(scene, options);
  for (int layers = 1; layers <= 5; ++layers) {
    options.layers = layers;
    const V4f pixel = shown(middle(render_or_fail(scene, {}, camera, options)));
    CHECK(pixel.x == doctest::Approx(0.5));
    CHECK(pixel.y == doctest::Approx(layers > 1 ? 0.25 : 0));
    CHECK(pixel.z == doctest::Approx(layers > 2 ? 0.125 : 0));
    CHECK(pixel.w == doctest::Approx(1 - std::pow(0.5, std::min(layers, 4))));
  }
}

TEST_CASE("a sphere of netting shows its own inside") {
  Scene scene;
  test::add(scene, test::sphere(32, 16, V2d(8, 4)), test::material(0));
  Fabric netting = test::lambert_fabric(4, V3f(1, 1, 1), 0);
  const RenderOptions options = small({{V3d(0, 0, 1), V3f(1, 1, 1)}});
  for (const float opacity : {0.0F, 0.5F}) {
    for (FabricLevel& level : netting.levels)
      std::fill(level.opacity().begin(), level.opacity().end(), opacity);
    RenderStats stats;
    const V4f pixel = middle(render_or_fail(scene, {netting}, camera_for(scene, options), options, &stats));
    CHECK(stats.layers == 2);
    CHECK(pixel.w == doctest::Approx(1 - (1 - opacity) * (1 - opacity)));
  }
}

TEST_CASE("through holes of two cloths behind each other as much is seen as with many rays") {
  // The same stripes twice: their mean twice would leave less.
  Scene scene;
  for (const float z : {0.0F, -0.001F}) test::add(scene, test::square(20, z), test::material(0));
  Fabric stripes = test::lambert_fabric(2, V3f(1, 1, 1), 0.5F);
  for (int i = 0; i < 4; ++i) stripes.levels[0].opacity()[i] = static_cast<float>(i % 2);
  RenderOptions options = small({{V3d(0, 0, 1), V3f(1, 1, 1)}});
  const auto draw = [&](int supersample) {
    options.supersample = supersample;
    return render_or_fail(scene, {stripes}, camera_for(scene, options), options);
  };
  const Frame best = draw(8);
  for (const auto& [supersample, max_error] : {std::pair(1, 0.022F), std::pair(2, 0.006F)}) {
    const Frame frame = draw(supersample);
    float sum = 0;
    for (std::size_t i = 0; i < frame.pixels.size(); ++i)
      sum += std::abs(frame.pixels[i].w - best.pixels[i].w);
    CHECK(sum <= max_error * static_cast<float>(frame.pixels.size()));
  }
}

TEST_CASE("opaque pixels end the work after the first layer") {
  Scene scene;
  test::add(scene, test::sphere(32, 16, V2d(8, 4)), test::material(0));
  const RenderOptions options = small({from_the_side});
  RenderStats stats;
  render_or_fail(scene, {test::lambert_fabric(4, V3f(1, 1, 1))}, camera_for(scene, options), options, &stats);
  CHECK(stats.layers == 1);
  CHECK(stats.evaluated_pixels == stats.covered_pixels);
  CHECK(stats.covered_pixels > 2000);
}

TEST_CASE("single-sided materials without fabric are not seen from behind, masks cut holes") {
  Scene scene;
  test::add(scene, test::square(1), test::material(-1, V4f(1, 1, 1, 0.4F)));
  RenderOptions options = small({{V3d(0, 0, -1), V3f(1, 1, 1)}});
  CameraOptions behind;
  behind.azimuth = 180;
  const Camera camera = camera_for(scene, options, behind);
  CHECK(middle(render_or_fail(scene, {}, camera, options)).w == 1);
  scene.materials[0].double_sided = false;
  CHECK(middle(render_or_fail(scene, {}, camera, options)).w == 0);
  scene.materials[0].double_sided = true;
  scene.materials[0].alpha_mode = AlphaMode::mask;
  CHECK(middle(render_or_fail(scene, {}, camera, options)).w == 0);
  scene.materials[0].alpha_cutoff = 0.3F;
  CHECK(middle(render_or_fail(scene, {}, camera, options)).w == 1);
}

TEST_CASE("base colour pictures are sampled in linear light and multiplied by the factor") {
  Scene scene;
  SceneMaterial material = test::material(-1, V4f(0.5F, 1, 1, 1));
  material.base_color_texture.image = 0;
  material.unlit = true;
  test::add(scene, test::square(1), material);
  Image picture{2, 16, 3, {}};
  // Upper half dark, lower half light.
  for (int i = 0; i < 32; ++i) picture.pixels.insert(picture.pixels.end(), 3, i < 16 ? 0.1F : 0.6F);
  const auto png = test::need(encode_png(picture));
  scene.images.push_back({"picture", "image/png", png});
  scene.images.push_back({"broken", "image/png", {1, 2, 3}});
  RenderOptions options = small({});
  options.width = options.height = 64;
  const Camera camera = camera_for(scene, options);
  RenderStats stats;
  const Frame frame = render_or_fail(scene, {}, camera, options, &stats);
  CHECK(stats.remarks.empty());
  const V4f dark = shown(frame.pixels[16 * 64 + 32]);
  const V4f light = shown(frame.pixels[48 * 64 + 32]);
  // An 8-bit sRGB step is below 0.01 here.
  CHECK(dark.y == doctest::Approx(0.1).epsilon(0.03));
  CHECK(light.y == doctest::Approx(0.6).epsilon(0.01));
  CHECK(light.x == doctest::Approx(light.y / 2));

  scene.materials[0].base_color_texture.image = 1;
  CHECK(shown(middle(render_or_fail(scene, {}, camera, options, &stats))).y == doctest::Approx(1));
  CHECK(stats.remarks.size() == 1);
}

TEST_CASE("supersampling converges to the same picture and smooths the outline") {
  Scene scene;
  test::add(scene, test::sphere(64, 32, V2d(1, 1)), test::material(-1));
  RenderOptions options = small({from_the_side});
  const Camera camera = camera_for(scene, options);
  const Frame rough = render_or_fail(scene, {}, camera, options);
  options.supersample = 3;
  const Frame smooth = render_or_fail(scene, {}, camera, options);
  int partial = 0;
  double rough_area = 0;
  double smooth_area = 0;
  for (std::size_t i = 0; i < smooth.pixels.size(); ++i) {
    if (smooth.pixels[i].w > 0 && smooth.pixels[i].w < 1) ++partial;
    rough_area += rough.pixels[i].w;
    smooth_area += smooth.pixels[i].w;
  }
  CHECK(partial > 50);
  CHECK(smooth_area == doctest::Approx(rough_area).epsilon(0.01));
  const V4f d = middle(rough) - middle(smooth);
  CHECK(std::sqrt(d.dot(d)) < 0.01);
}

TEST_CASE("frames that need several bands have no seams") {
  Scene scene;
  test::add(scene, test::sphere(64, 32, V2d(1, 1)), test::material(-1));
  RenderOptions options;
  // More than the 2^21 pixels of a band.
  options.width = 16;
  options.height = 16;
  options.supersample = 1;
  options.lights = {from_the_side};
  const Camera camera = camera_for(scene, options);
  options.width = options.height = 1600;
  RenderStats stats;
  const Frame large = render_or_fail(scene, {}, camera, options, &stats);
  double steepest = 0;
  for (int y = 400; y < 1200; ++y) {
    for (const int x : {700, 800, 900}) {
      const std::size_t i = static_cast<std::size_t>(y * 1600 + x);
      steepest = std::max<double>(steepest, std::abs(large.pixels[i].x - large.pixels[i + 1600].x));
    }
  }
  // The sphere's radiance changes by at most 3 / pi over some 700 pixels.
  CHECK(steepest < 0.005);
}

TEST_CASE("render refuses with a code") {
  Scene scene;
  test::add(scene, test::square(1), test::material(0));
  const RenderOptions good = small({});
  const Camera camera = camera_for(scene, good);
  const std::vector<Fabric> fabrics{test::random_fabric(4, 4, 1)};
  const auto code_of = [&](const Scene& s, const std::vector<Fabric>& f, const RenderOptions& o) {
    return test::error_of(render(s, f, camera, o)).code;
  };
  CHECK(code_of(Scene{}, {}, good) == Code::garment_empty);
  RenderOptions options = good;
  options.width = 0;
  CHECK(code_of(scene, fabrics, options) == Code::option_out_of_range);
  options = good;
  options.supersample = 1000;
  CHECK(code_of(scene, fabrics, options) == Code::option_out_of_range);
  options = good;
  options.layers = 0;
  CHECK(code_of(scene, fabrics, options) == Code::option_out_of_range);
  scene.primitives[0].tex_coords[0].clear();
  CHECK(code_of(scene, fabrics, good) == Code::garment_no_uvs);
}

}  // namespace
}  // namespace selvedge
