#include "viewer/hybrid/shade.h"

#include <doctest/doctest.h>

#include <cmath>

#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "tests/format/fabrics.h"
#include "tests/require.h"
#include "tests/viewer/indexed.h"
#include "tests/viewer/plain_frame.h"

namespace selvedge {
namespace {

V3d lane(const LaneDirections& d, std::size_t i) {
  return {static_cast<double>(d.x[i]), static_cast<double>(d.y[i]), static_cast<double>(d.z[i])};
}

void set(LaneDirections& d, std::size_t i, const V3f& v) {
  d.x[i] = v.x;
  d.y[i] = v.y;
  d.z[i] = v.z;
}

Camera parallel(const V3d& to_viewer) {
  Camera camera;
  camera.projection = Projection::parallel;
  camera.to_viewer = to_viewer;
  return camera;
}

TEST_CASE("the garment's frame is orthonormal and faces the viewer whatever was interpolated") {
  Random random(9);
  const auto number = [&] { return static_cast<float>(random.uniform() * 2 - 1); };
  for (int i = 0; i < 100; ++i) {
    PixelBlock block;
    block.count = lane_count;
    const V3d view = V3d(V3f(number(), number(), number())).normalized();
    for (std::size_t k = 0; k < lane_count; ++k) {
      set(block.normal, k, {number(), number(), number()});
      set(block.tangent, k, {number(), number(), number()});
      block.handedness[k] = k % 2 == 0 ? 1.0F : -1.0F;
      block.side[k] = k % 3 == 0 ? -1.0F : 1.0F;
      if (k == 3) set(block.normal, k, {0, 0, 0});
      if (k == 4) set(block.tangent, k, {0, 0, 0});
      if (k == 5) set(block.normal, k, {HUGE_VALF, 0, 0});
      if (k == 6) set(block.tangent, k, {HUGE_VALF, NAN, 0});
    }
    const LaneFrames frames = garment_frames(parallel(view), 8, 8, block);
    for (std::size_t k = 0; k < lane_count; ++k) {
      CAPTURE(k);
      const V3d n = lane(frames.normal, k);
      const V3d t = lane(frames.tangent, k);
      CHECK(n.length() == doctest::Approx(1));
      CHECK(t.length() == doctest::Approx(1));
      // Where the tangent is nearly the normal little is left of it, and rounding shows.
      CHECK(std::abs(n.dot(t)) < 1e-4);
      const double sign = static_cast<double>(block.side[k] * block.handedness[k]);
      CHECK((n.cross(t) * sign - lane(frames.up, k)).length() < 1e-5);
      CHECK(n.dot(view) > 0);
      CHECK((lane(frames.view, k) - V3d(view.dot(t), view.dot(lane(frames.up, k)), view.dot(n))).length() <
            1e-5);
      if (k < 3 || k > 6) {
        const test::PlainFrame plain = test::plain_frame(lane(block.normal, k), lane(block.tangent, k),
                                                         static_cast<double>(block.handedness[k]),
                                                         static_cast<double>(block.side[k]), view);
        CHECK((plain.normal - n).length() < 1e-5);
        if (lane(block.tangent, k).normalized().cross(n).length() > 0.1)
          CHECK((plain.tangent - t).length() < 1e-4);
      }
    }
  }
}

/// Largest difference in sRGB between the viewer's shading of every pixel, over black, and the reference
/// evaluation of the same texels in plain frames.
double worst_difference(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
                        const LevelOptions& levels, std::span<const Light> lights, int& pixels) {
  constexpr int width = 160;
  constexpr int height = 120;
  const test::Indexed indexed = test::index_nearest(scene, fabrics, camera, width, height, levels);
  const ShadingScene shading{camera, width, height, indexed.materials, indexed.packed, lights};
  ShadingScratch scratch;
  double worst = 0;
  for (const PixelBlock& block : indexed.blocks) {
    const LaneShading& found = shade(shading, block, scratch);
    for (std::size_t k = 0; k < block.count; ++k) {
      ++pixels;
      const int fabric_index = indexed.materials[block.surface[k]].fabric;
      REQUIRE(fabric_index >= 0);
      const Fabric& fabric = fabrics[fabric_index];
      const V3d view = view_direction(
          camera, V2d((2.0 * block.x[k] + 1) / width - 1, (2.0 * block.y[k] + 1) / height - 1));
      const test::PlainFrame frame = test::plain_frame(lane(block.normal, k), lane(block.tangent, k),
                                                       static_cast<double>(block.handedness[k]),
                                                       static_cast<double>(block.side[k]), view);
      V3d sum(0, 0, 0);
      double alpha = 0;
      for (std::size_t i = 0; i < block.texel_count; ++i) {
        const LaneTexels& of = block.texels[i];
        if (of.weight[k] == 0) continue;
        const int w = fabric.levels[of.level[k]].width;
        for (const Light& light : lights) {
          const Shading one = evaluate(fabric, of.level[k], of.texel[k] % w, of.texel[k] / w,
                                       frame.into(light.direction), frame.into(view));
          sum += V3d(one.radiance * light.irradiance * (of.weight[k] * one.alpha));
          if (&light == lights.data()) alpha += static_cast<double>(of.weight[k] * one.alpha);
        }
      }
      const std::array<float, 3> colour{found.red[k], found.green[k], found.blue[k]};
      for (unsigned c = 0; c < 3; ++c)
        worst = std::max(worst, std::abs(test::srgb(sum[static_cast<int>(c)]) -
                                         test::srgb(static_cast<double>(colour[c]))));
      worst = std::max(worst, std::abs(alpha - static_cast<double>(found.alpha[k])));
    }
  }
  return worst;
}

TEST_CASE("the picture is within 1/255 of the reference evaluation over the same texels, on every pixel") {
  CameraOptions options;
  options.elevation = 20;
  options.azimuth = 30;
  const std::vector<V3d> points{V3d(-1, -1, -1), V3d(1, 1, 1)};
  const Camera camera = test::need(make_camera(points, 4.0 / 3, options));
  const std::vector<Light> lights = default_lights(camera);
  const Fabric products = test::random_product_fabric(16, 16, {8, 8}, 2, 4);
  Fabric lobes_alone = test::random_fabric(16, 16, {8, 8}, 3, 5);
  for (FabricLevel& level : lobes_alone.levels) {
    level.remove(LayerKind::table);
    level.remove(LayerKind::opacity);
  }
  const std::vector<std::vector<Fabric>> sets{
      {test::random_fabric(32, 32, {8, 8}, 2, 1), test::random_fabric(9, 7, {4, 6}, 1, 2)},
      {products, lobes_alone},
      {lobes_alone, products}};
  double worst = 0;
  int pixels = 0;
  for (const std::vector<Fabric>& fabrics : sets) {
    for (const LevelOptions& levels : {LevelOptions(), best_levels}) {
      Scene scene;
      test::add(scene, test::sphere(48, 24, V2d(20, 10)), test::material(0));
      M44d aside;
      aside.setTranslation(V3d(0.9, 0.3, -0.4));
      test::add(scene, test::square(40, 0), test::material(1), aside);
      worst = std::max(worst, worst_difference(scene, fabrics, camera, levels, lights, pixels));
    }
  }
  MESSAGE("largest difference seen: " << worst * 255 << " / 255 over " << pixels << " pixels");
  CHECK(pixels > 30000);
  CHECK(worst * 255 <= 1);
}

TEST_CASE("a lobe that overflows stays finite") {
  Fabric fabric = test::lambert_fabric(2, V3f(1, 1, 1));
  for (FabricLevel& level : fabric.levels) {
    level.add(LayerKind::lobes, 15, 1e4F);
    for (int i = 0; i < level.texels() * 3; ++i) level.lobes()[5 * i] = 0;
  }
  Scene scene;
  test::add(scene, test::square(1), test::material(0));
  const std::vector<Fabric> fabrics{fabric};
  const Camera camera = parallel(V3d(0.28, 0, 0.96));
  const Light light{V3d(0, 0.6, 0.8), V3f(2, 2, 2)};
  const test::Indexed indexed = test::index_nearest(scene, fabrics, camera, 8, 8, {});
  REQUIRE(!indexed.blocks.empty());
  ShadingScratch scratch;
  const LaneShading& found =
      shade({camera, 8, 8, indexed.materials, indexed.packed, {&light, 1}}, indexed.blocks[0], scratch);
  CHECK(std::isfinite(found.red[0]));
  CHECK(found.red[0] > 0);
}

}  // namespace
}  // namespace selvedge
