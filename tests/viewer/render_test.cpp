#include "viewer/render.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "format/base/parallel.h"
#include "tests/viewer/shapes.h"
#include "viewer/scene/surfaces.h"

namespace selvedge {
namespace {

Camera camera_for(const Scene& scene, const RenderOptions& options,
                  const CameraOptions& camera_options = {}) {
  const auto points = world_points(scene);
  REQUIRE(points);
  const auto camera =
      make_camera(*points, static_cast<double>(options.width) / options.height, camera_options);
  REQUIRE(camera);
  return *camera;
}

Frame render_or_fail(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
                     const RenderOptions& options, RenderStats* stats = nullptr) {
  const Result<Frame> frame = render(scene, fabrics, camera, options, stats);
  test::require(frame);
  REQUIRE(frame->pixels.size() == static_cast<std::size_t>(options.width * options.height));
  return *frame;
}

RenderOptions small(std::vector<Light> lights) {
  RenderOptions options;
  options.width = 120;
  options.height = 100;
  options.lights = std::move(lights);
  return options;
}

const Light from_the_side{V3d(0.48, 0.6, 0.64), V3f(3, 2, 1)};

bool same_bytes(const Frame& a, const Frame& b) {
  return a.pixels.size() == b.pixels.size() &&
         std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(V4f)) == 0;
}

V4f middle(const Frame& frame) { return frame.pixels[frame.height / 2 * frame.width + frame.width / 2]; }

/// An unlit colour: radiance is the colour over pi.
V4f shown(const V4f& pixel) {
  const float pi = std::numbers::pi_v<float>;
  return {pixel.x * pi, pixel.y * pi, pixel.z * pi, pixel.w};
}

TEST_CASE("a Lambertian sphere shows albedo / pi * cosine * irradiance, as a fabric") {
  const V3f albedo(0.8F, 0.5F, 0.2F);
  Scene scene;
  test::add(scene, test::sphere(256, 128, V2d(60, 30)), test::material(0));
  const RenderOptions options = small({from_the_side});
  const Camera camera = camera_for(scene, options);
  const Frame frame = render_or_fail(scene, {test::lambert_fabric(8, albedo)}, camera, options);
  double worst = 0;
  int compared = 0;
  for (int y = 0; y < options.height; ++y) {
    for (int x = 0; x < options.width; ++x) {
      const V3d away =
          -view_direction(camera, V2d((2.0 * x + 1) / options.width - 1, 1 - (2.0 * y + 1) / options.height));
      const V4f& pixel = frame.pixels[y * options.width + x];
      const double along = -camera.position.dot(away);
      const double under_root = along * along - camera.position.length2() + 1;
      // The silhouette is a polygon's, and normals there are bent to the horizon.
      if (under_root < 0.01) continue;
      const V3d normal = camera.position + away * (along - std::sqrt(under_root));
      const double cosine = std::max(0.0, normal.dot(from_the_side.direction));
      for (unsigned c = 0; c < 3; ++c) {
        const double expected = albedo[static_cast<int>(c)] / std::numbers::pi * cosine *
                                from_the_side.irradiance[static_cast<int>(c)];
        worst = std::max(worst, std::abs(expected - pixel[c]));
      }
      CHECK(pixel.w == 1);
      ++compared;
    }
  }
  CHECK(compared > 2000);
  // 256 segments: positions are off by 1 - cos(pi / 256) = 8e-5, interpolated normals by as much.
  CHECK(worst < 1e-3);
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
    CHECK(pixel.x == doctest::Approx(0.5 / std::numbers::pi));
    CHECK(pixel.y == doctest::Approx(0.5 / std::numbers::pi));
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
  CHECK(middle(frame).x == doctest::Approx(1 / std::numbers::pi));
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

TEST_CASE("deep pixels show the same whether OpenGL peels them or the processor casts rays") {
  Scene scene;
  M44d larger;
  larger.setScale(1.4);
  M44d aside;
  aside.setTranslation(V3d(0.3, 0.2, 0.1));
  test::add(scene, test::sphere(48, 24, V2d(8, 4)), test::material(0), larger);
  test::add(scene, test::sphere(48, 24, V2d(8, 4)), test::material(0));
  test::add(scene, test::sphere(48, 24, V2d(8, 4)), test::material(0), aside);
  Fabric netting = test::lambert_fabric(4, V3f(1, 0.5F, 0.25F), 0.4F);
  RenderOptions options = small({from_the_side});
  const Camera camera = camera_for(scene, options);
  RenderStats stats;
  const Frame cast = render_or_fail(scene, {netting}, camera, options, &stats);
  CHECK(stats.layers == 6);
  // A surface without fabric, out of sight: its mask might matter, so OpenGL does the work.
  M44d away;
  away.setTranslation(V3d(0, 0, 50));
  test::add(scene, test::square(1), test::material(-1), away);
  const Frame peeled = render_or_fail(scene, {netting}, camera, options, &stats);
  CHECK(stats.layers == 6);
  int different = 0;
  int covered = 0;
  for (std::size_t i = 0; i < cast.pixels.size(); ++i) {
    const V4f d = cast.pixels[i] - peeled.pixels[i];
    covered += cast.pixels[i].w > 0 ? 1 : 0;
    different += std::sqrt(d.dot(d)) > 1e-3F ? 1 : 0;
  }
  CHECK(covered > 3000);
  // Where an edge passes within OpenGL's 1/256 of a pixel's centre.
  CHECK(different * 100 < covered);
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

TEST_CASE("a cloth without thickness looks the same lit and seen from behind, mirrored") {
  const Fabric fabric = test::random_fabric(8, 8, 2);
  Scene scene;
  test::add(scene, test::square(1), test::material(0));
  RenderOptions options;
  options.width = options.height = 8;
  options.layers = 1;
  options.levels.forced = 0;
  Camera camera;
  camera.projection = Projection::parallel;
  camera.position = V3d(0, 0, 0);
  camera.near = -5;
  camera.far = 5;
  camera.to_viewer = V3d(0.48, 0.64, 0.6);
  options.lights = {{V3d(-0.6, 0, 0.8), V3f(1, 1, 1)}};
  const Frame front = render_or_fail(scene, {fabric}, camera, options);
  // Viewer and light reflected in the cloth's plane; the image's right is now the world's left.
  camera.right = V3d(-1, 0, 0);
  camera.to_viewer = V3d(0.48, 0.64, -0.6);
  options.lights = {{V3d(-0.6, 0, -0.8), V3f(1, 1, 1)}};
  const Frame back = render_or_fail(scene, {fabric}, camera, options);
  float worst = 0;
  for (std::size_t y = 0; y < 8; ++y) {
    for (std::size_t x = 0; x < 8; ++x) {
      const V4f d = front.pixels[y * 8 + x] - back.pixels[y * 8 + (7 - x)];
      worst = std::max(worst, std::sqrt(d.dot(d)));
    }
  }
  CHECK(worst < 1e-5F);
  CHECK(front.pixels[0] != front.pixels[1]);
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
  const auto png = encode_png(picture);
  REQUIRE(png);
  scene.images.push_back({"picture", "image/png", *png});
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

TEST_CASE("the frame's bytes do not depend on the number of threads") {
  Scene scene;
  test::add(scene, test::sphere(48, 24, V2d(30, 15)), test::material(0));
  RenderOptions options = small(default_lights(Camera{}));
  options.supersample = 2;
  const Camera camera = camera_for(scene, options);
  const std::vector<Fabric> fabrics{test::random_fabric(16, 16, 6)};
  set_threads(1);
  const Frame one = render_or_fail(scene, fabrics, camera, options);
  set_threads(2);
  const Frame two = render_or_fail(scene, fabrics, camera, options);
  set_threads(0);
  CHECK(same_bytes(one, two));
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

TEST_CASE("tiny frames, degenerate triangles and huge texture coordinates give finite pictures") {
  Scene scene;
  ScenePrimitive p = test::square(1);
  p.indices.insert(p.indices.end(), {0, 0, 0, 1, 1, 2});
  for (V2d& uv : p.tex_coords[0]) uv = uv * 1e30 + V2d(1e200, -1e200);
  test::add(scene, p, test::material(0));
  ScenePrimitive flat = test::square(4, 0.1F);
  flat.tex_coords[0].assign(4, V2d(0.3, 0.3));
  flat.normals.assign(4, V3f(0, 0, 0));
  test::add(scene, flat, test::material(0));
  for (const V2i& size : {V2i(1, 1), V2i(3, 1), V2i(1, 7), V2i(33, 21)}) {
    RenderOptions options;
    options.width = size.x;
    options.height = size.y;
    options.lights = {from_the_side};
    const Frame frame =
        render_or_fail(scene, {test::random_fabric(5, 3, 1)}, camera_for(scene, options), options);
    for (const V4f& pixel : frame.pixels) {
      for (unsigned c = 0; c < 4; ++c) CHECK(std::isfinite(pixel[c]));
    }
  }
}

TEST_CASE("render refuses with a code") {
  Scene scene;
  test::add(scene, test::square(1), test::material(0));
  const RenderOptions good = small({});
  const Camera camera = camera_for(scene, good);
  const std::vector<Fabric> fabrics{test::random_fabric(4, 4, 1)};
  const auto code_of = [&](const Scene& s, const std::vector<Fabric>& f, const RenderOptions& o) {
    const Result<Frame> frame = render(s, f, camera, o);
    REQUIRE_FALSE(frame);
    return frame.error().code;
  };
  CHECK(code_of(Scene{}, {}, good) == Code::garment_empty);
  CHECK(code_of(scene, {}, good) == Code::gltf_reference);
  Fabric odd = fabrics[0];
  odd.levels[1].width = 3;
  CHECK(code_of(scene, {odd}, good) == Code::fabric_malformed);
  RenderOptions options = good;
  options.width = 0;
  CHECK(code_of(scene, fabrics, options) == Code::option_out_of_range);
  options = good;
  options.supersample = 1000;
  CHECK(code_of(scene, fabrics, options) == Code::option_out_of_range);
  options = good;
  options.layers = 0;
  CHECK(code_of(scene, fabrics, options) == Code::option_out_of_range);
  options = good;
  options.path = RenderPath::shader;
  options.power = PowerKind::fast;
  CHECK(code_of(scene, fabrics, options) == Code::option_out_of_range);
  scene.primitives[0].tex_coords[0].clear();
  CHECK(code_of(scene, fabrics, good) == Code::garment_no_uvs);
}

}  // namespace
}  // namespace selvedge
