#include "viewer/shade.h"

#include <doctest/doctest.h>

#include <cmath>

#include "format/random.h"
#include "tests/viewer/shapes.h"

namespace selvedge {
namespace {

void check_frame(const GarmentFrame& f, const V3f& view, bool left_handed) {
  CHECK(f.normal.length() == doctest::Approx(1));
  CHECK(f.tangent.length() == doctest::Approx(1));
  CHECK(std::abs(f.normal.dot(f.tangent)) < 1e-5F);
  CHECK((f.normal.cross(f.tangent) * (left_handed ? -1.0F : 1.0F) - f.up).length() < 1e-5F);
  CHECK(f.normal.dot(view) > 0);
}

TEST_CASE("the garment's frame is orthonormal and faces the viewer whatever was interpolated") {
  Random random(9);
  const auto number = [&] { return static_cast<float>(random.uniform() * 2 - 1); };
  for (int i = 0; i < 500; ++i) {
    const V3f normal(number(), number(), number());
    const V3f view = V3f(number(), number(), number()).normalized();
    const V4f tangent(number(), number(), number(), i % 2 == 0 ? 1.0F : -1.0F);
    const bool back = i % 3 == 0;
    check_frame(garment_frame(normal, tangent, back, view), view, (tangent.w < 0) != back);
  }
}

TEST_CASE("both sides of a cloth have the same tangent and up direction") {
  const V4f tangent(1, 0, 0, 1);
  const GarmentFrame front = garment_frame(V3f(0, 0, 1), tangent, false, V3f(0, 0.6F, 0.8F));
  const GarmentFrame back = garment_frame(V3f(0, 0, 1), tangent, true, V3f(0, 0.6F, -0.8F));
  CHECK(front.tangent == V3f(1, 0, 0));
  CHECK(front.up == V3f(0, 1, 0));
  CHECK(front.normal == V3f(0, 0, 1));
  CHECK(back.tangent == front.tangent);
  CHECK(back.up == front.up);
  CHECK(back.normal == V3f(0, 0, -1));
}

TEST_CASE("vanished normals and tangents leave a usable frame") {
  const V3f view(0, 0, 1);
  check_frame(garment_frame(V3f(0, 0, 0), V4f(0, 0, 0, 1), false, view), view, false);
  check_frame(garment_frame(V3f(0, 0, 0), V4f(0, 0, 1, 1), true, view), view, true);
  check_frame(garment_frame(V3f(0, 0, -1), V4f(1, 0, 0, 1), false, view), view, false);
  check_frame(garment_frame(V3f(HUGE_VALF, 0, 0), V4f(HUGE_VALF, 0, 0, 1), false, view), view, false);
}

TEST_CASE("a normal that faces the viewer is not bent") {
  const V3f normal = V3f(0.3F, 0.1F, 0.9F).normalized();
  CHECK((garment_frame(normal, V4f(1, 0, 0, 1), false, V3f(0, 0, 1)).normal - normal).length() < 1e-6F);
}

/// One pixel of one surface of a fabric, shaded behind `before`.
V4f shade_one(const Fabric& fabric, float weight, const V4f& before) {
  PixelLayer layer;
  layer.width = layer.rows = 1;
  layer.normal = {V4f(0, 0, 1, weight)};
  layer.surface = {V4f(1, 0, 0, 1)};
  layer.texels = {{1, 0, 0, 0}};
  layer.marks = {{1, 0, 1, 0}};
  SurfaceLook look;
  look.fabric = 0;
  look.keeps_opacity = true;
  const Light light{V3d(0, 0.6, 0.8), V3f(2, 2, 2)};
  Camera camera;
  camera.projection = Projection::parallel;
  camera.to_viewer = V3d(0.28, 0, 0.96);
  const ShadingScene scene{camera, 1, 1, {&look, 1}, {&fabric, 1}, {&light, 1}};
  V4f pixel = before;
  std::uint8_t finished = 0;
  shade_layer(scene, layer, 0, {&pixel, 1}, {&finished, 1});
  return pixel;
}

TEST_CASE("a pixel between two levels is their blend weighted by opacity, laid behind what is before it") {
  const Fabric fabric = test::random_fabric(2, 2, 8);
  const V3f light(0, 0.6F, 0.8F);
  const V3f view(0.28F, 0, 0.96F);
  const Shading a = evaluate(fabric, 0, 1, 0, light, view);
  const Shading b = evaluate(fabric, 1, 0, 0, light, view);
  const float w = 0.3F;
  const V4f before(0.1F, 0.2F, 0.3F, 0.4F);
  const V4f pixel = shade_one(fabric, w, before);
  const float alpha = (1 - w) * a.alpha + w * b.alpha;
  CHECK(pixel.w == doctest::Approx(0.4F + 0.6F * alpha));
  for (int c = 0; c < 3; ++c) {
    // alpha * radiance of the blend is the weighted sum of the two alpha * radiance.
    const float sum = (1 - w) * a.alpha * a.radiance[c] + w * b.alpha * b.radiance[c];
    CHECK(pixel[static_cast<unsigned>(c)] ==
          doctest::Approx(before[static_cast<unsigned>(c)] + 0.6F * 2 * sum).epsilon(1e-5));
  }
}

TEST_CASE("a lobe that overflows stays finite") {
  Fabric fabric = test::lambert_fabric(2, V3f(1, 1, 1));
  for (FabricLevel& level : fabric.levels) {
    level.lobes->lobes = 1;
    level.lobes->parameters.clear();
    for (int i = 0; i < level.texels() * 3; ++i)
      level.lobes->parameters.insert(level.lobes->parameters.end(), {0.0F, 1e4F, 1e4F, 1e4F, 1e4F});
  }
  const V4f pixel = shade_one(fabric, 0.5F, V4f(0, 0, 0, 0));
  CHECK(std::isfinite(pixel.dot(V4f(1, 1, 1, 1) * 1e-8F)));
  CHECK(pixel.x > 0);
}

}  // namespace
}  // namespace selvedge
