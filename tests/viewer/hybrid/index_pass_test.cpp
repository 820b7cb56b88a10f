#include "viewer/hybrid/index_pass.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "format/fabric/evaluate.h"
#include "format/gltf/read_scene.h"
#include "format/scene/footprint.h"
#include "tests/require.h"
#include "tests/viewer/indexed.h"
#include "tests/viewer/ray_caster.h"

namespace selvedge {
namespace {

Camera tilted(double aspect) {
  CameraOptions options;
  options.elevation = 35;
  options.azimuth = 25;
  options.zoom = 1.7;
  const std::vector<V3d> points{V3d(-1, -1, 0), V3d(1, -1, 0), V3d(1, 1, 0), V3d(-1, 1, 0)};
  return test::need(make_camera(points, aspect, options));
}

/// log2 of the longer axis of the ellipse that a disc of one pixel becomes among the texels of level 0: the
/// larger singular value of the 2 x 2 matrix of slopes.
double expected_level(const V2d& right, const V2d& up) {
  const double sum = right.length2() + up.length2();
  const double det = right.x * up.y - right.y * up.x;
  return 0.5 * std::log2((sum + std::sqrt(std::max(0.0, sum * sum - 4 * det * det))) / 2);
}

struct Agreement {
  int compared = 0;
  int wrong = 0;
  double worst_level = 0;
};

/// Every `step`th covered pixel against a ray: triangle, texels and level.
Agreement compare_to_rays(const test::Indexed& indexed, const std::vector<Fabric>& fabrics,
                          const Camera& camera, int step) {
  const test::RayCaster rays(indexed.mesh, V2i(indexed.width, indexed.height), camera);
  Agreement result;
  int number = 0;
  test::each_pixel(indexed, [&](const PixelBlock& block, std::size_t lane) {
    if (number++ % step != 0) return;
    const double x = block.x[lane] + 0.5;
    const double y = block.y[lane] + 0.5;
    const std::optional<test::RayHit> hit = rays.cast(x, y);
    // At the edges of triangles a rasteriser rounds to 1/256 of a pixel.
    if (!hit || rays.inside(hit->triangle, x + 0.01, y) < 0 || rays.inside(hit->triangle, x - 0.01, y) < 0 ||
        rays.inside(hit->triangle, x, y + 0.01) < 0 || rays.inside(hit->triangle, x, y - 0.01) < 0)
      return;
    const MergedTriangle& triangle = indexed.mesh.triangles[hit->triangle];
    const Fabric& fabric = fabrics[indexed.materials[triangle.surface].fabric];
    const V2d size(fabric.levels[0].width, fabric.levels[0].height);
    const V2d uv = rays.uv(hit->triangle, x, y);
    constexpr double h = 1e-3;
    const V2d right = (rays.uv(hit->triangle, x + h, y) - rays.uv(hit->triangle, x - h, y)) * size / (2 * h);
    const V2d up = (rays.uv(hit->triangle, x, y + h) - rays.uv(hit->triangle, x, y - h)) * size / (2 * h);
    const double last = static_cast<double>(fabric.levels.size()) - 1;
    const double level = std::clamp(expected_level(right, up), 0.0, last);
    bool counts = level == 0 || level == last || test::to_edge(level) > 1e-3;
    bool good =
        block.texels[0].level[lane] == static_cast<int>(level) && block.surface[lane] == triangle.surface;
    for (std::size_t k = 0; k < 2 && good; ++k) {
      if (block.texels[k].weight[lane] == 0) continue;
      const FabricLevel& of = fabric.levels[block.texels[k].level[lane]];
      if (test::to_edge(uv.x * of.width) < 0.02 || test::to_edge(uv.y * of.height) < 0.02) counts = false;
      good =
          block.texels[k].texel[lane] == wrap_texel(uv.y, of.height) * of.width + wrap_texel(uv.x, of.width);
    }
    if (!counts) return;
    result.worst_level = std::max(result.worst_level, std::abs(test::level_of(block, lane) - level));
    ++result.compared;
    if (!good) ++result.wrong;
  });
  return result;
}

TEST_CASE("texels and levels are those of a ray through the pixel, on 99.9 % of the pixels off the edges") {
  constexpr int width = 240;
  constexpr int height = 180;
  for (const V2i& size : {V2i(16, 16), V2i(64, 24), V2i(5, 3)}) {
    const std::vector<Fabric> fabrics{test::random_fabric(size.x, size.y, 1)};
    for (const double repeats : {1.0, 7.0, 300.0}) {
      Scene scene;
      test::add(scene, test::square(repeats), test::material(0));
      const Camera camera = tilted(static_cast<double>(width) / height);
      const Agreement a =
          compare_to_rays(test::index_nearest(scene, fabrics, camera, width, height, {}), fabrics, camera, 1);
      CAPTURE(repeats);
      MESSAGE(a.wrong << " of " << a.compared << " pixels differ, levels by " << a.worst_level);
      CHECK(a.compared > 5000);
      CHECK(a.wrong * 1000 <= a.compared);
      CHECK(a.worst_level < 1e-3);
    }
    Scene scene;
    test::add(scene, test::sphere(24, 12, V2d(30, 15)), test::material(0));
    const std::vector<V3d> points{V3d(-1, -1, -1), V3d(1, 1, 1)};
    const Camera& camera = test::need(make_camera(points, static_cast<double>(width) / height, {}));
    const Agreement a =
        compare_to_rays(test::index_nearest(scene, fabrics, camera, width, height, {}), fabrics, camera, 1);
    CHECK(a.compared > 5000);
    CHECK(a.wrong * 1000 <= a.compared);
    CHECK(a.worst_level < 1e-3);
  }
}

TEST_CASE("a footprint's axes are the singular values of the slopes, and its parts are round") {
  Random random(4);
  for (int i = 0; i < 2000; ++i) {
    const auto number = [&] {
      return static_cast<float>(std::exp(8 * random.uniform() - 4) * (random.uniform() < 0.5 ? -1 : 1));
    };
    const TexelSlopes<float> s{number(), number(), number(), number()};
    const V2d right(static_cast<double>(s.x_along_right), static_cast<double>(s.y_along_right));
    const V2d up(static_cast<double>(s.x_along_up), static_cast<double>(s.y_along_up));
    const double longest = expected_level(right, up);
    const double shortest = std::log2(std::abs(right.x * up.y - right.y * up.x)) - longest;
    const Footprint<float> one = footprint(s, 1);
    CHECK(static_cast<double>(one.level) == doctest::Approx(longest).epsilon(1e-5));
    CHECK(one.ratio == 1);
    const Footprint<float> eight = footprint(s, 8);
    CHECK(static_cast<double>(eight.level) == doctest::Approx(std::max(shortest, longest - 3)).epsilon(1e-3));
    CHECK(static_cast<double>(eight.level + std::log2(eight.ratio)) ==
          doctest::Approx(longest).epsilon(1e-4));
    // The axis, moved back into the pixel, is as long as what is taken off the long axis there.
    const V2d axis(static_cast<double>(eight.axis_x), static_cast<double>(eight.axis_y));
    CHECK(axis.length() ==
          doctest::Approx(std::exp2(longest) - std::exp2(static_cast<double>(eight.level))).epsilon(1e-3));
  }
}

TEST_CASE("what a pixel's coordinates do not tell is level 0") {
  const Footprint<float> none = footprint(TexelSlopes<float>{0, 0, 0, 0}, 4);
  CHECK(none.level < 0);
  CHECK(none.axis_x == 0);
}

TEST_CASE("several taps lie along the footprint's longer axis, with levels as fine as its shorter one") {
  const std::vector<Fabric> fabrics{test::random_fabric(32, 32, 1)};
  Scene scene;
  test::add(scene, test::square(20), test::material(0));
  CameraOptions grazing;
  grazing.elevation = 75;
  const std::vector<V3d> points{V3d(-1, -1, 0), V3d(1, 1, 0)};
  const Camera camera = test::need(make_camera(points, 1, grazing));
  LevelOptions one;
  LevelOptions four;
  four.taps = 4;
  const test::Indexed a = test::index_nearest(scene, fabrics, camera, 100, 100, one);
  const test::Indexed b = test::index_nearest(scene, fabrics, camera, 100, 100, four);
  REQUIRE(a.blocks.size() == b.blocks.size());
  int finer = 0;
  for (std::size_t i = 0; i < a.blocks.size(); ++i) {
    for (std::size_t lane = 0; lane < a.blocks[i].count; ++lane) {
      float sum = 0;
      for (std::size_t k = 0; k < b.blocks[i].texel_count; ++k) sum += b.blocks[i].texels[k].weight[lane];
      CHECK(sum == doctest::Approx(1));
      CHECK(b.blocks[i].texels[0].level[lane] <= a.blocks[i].texels[0].level[lane]);
      finer += b.blocks[i].texels[0].level[lane] < a.blocks[i].texels[0].level[lane] ? 1 : 0;
    }
    CHECK(b.blocks[i].texel_count <= 8);
  }
  // At 15 degrees above the cloth the footprint is four times as long as wide: two levels.
  CHECK(finer > 1000);
}

TEST_CASE("linear taps are the four texels around, and sum to 1; texels of level 0 keep their edges") {
  const std::vector<Fabric> fabrics{test::random_fabric(32, 32, 1)};
  Scene scene;
  test::add(scene, test::square(5), test::material(0));
  LevelOptions linear;
  linear.linear = true;
  int four = 0;
  int one = 0;
  test::each_pixel(test::index_nearest(scene, fabrics, tilted(1), 100, 100, linear),
                   [&](const PixelBlock& block, std::size_t lane) {
                     float sum = 0;
                     std::array<int, 6> of_level{};
                     for (std::size_t k = 0; k < block.texel_count; ++k) {
                       if (block.texels[k].weight[lane] == 0) continue;
                       sum += block.texels[k].weight[lane];
                       ++of_level[block.texels[k].level[lane]];
                     }
                     CHECK(sum == doctest::Approx(1));
                     CHECK(of_level[0] <= 1);
                     one += of_level[0];
                     for (std::size_t level = 1; level < 6; ++level) {
                       CHECK(of_level[level] <= 4);
                       four += of_level[level] == 4 ? 1 : 0;
                     }
                   });
  CHECK(one > 100);
  CHECK(four > 1000);
}

TEST_CASE("levels that a fabric does not have are never chosen") {
  std::vector<Fabric> fabrics{test::random_fabric(32, 32, 1)};
  fabrics[0].levels.resize(2);
  Scene scene;
  test::add(scene, test::square(1000), test::material(0));
  for (const bool blend : {false, true}) {
    for (const int forced : {-1, 5}) {
      LevelOptions levels;
      levels.blend = blend;
      levels.forced = forced;
      int seen = 0;
      test::each_pixel(test::index_nearest(scene, fabrics, tilted(1), 64, 64, levels),
                       [&](const PixelBlock& block, std::size_t lane) {
                         ++seen;
                         CHECK(block.texels[0].level[lane] <= 1);
                         CHECK(block.texels[1].level[lane] <= 1);
                         if (!blend) CHECK(block.texels[1].weight[lane] == 0);
                       });
      CHECK(seen > 1000);
    }
  }
}

TEST_CASE("texture coordinates that overflow still name a texel") {
  const std::vector<Fabric> fabrics{test::random_fabric(8, 8, 1)};
  for (const double repeats : {1e12, 1e30, 3e38}) {
    for (const bool linear : {false, true}) {
      Scene scene;
      test::add(scene, test::square(repeats), test::material(0));
      LevelOptions levels;
      levels.taps = 4;
      levels.linear = linear;
      int seen = 0;
      test::each_pixel(test::index_nearest(scene, fabrics, tilted(1), 32, 32, levels),
                       [&](const PixelBlock& block, std::size_t lane) {
                         ++seen;
                         for (std::size_t k = 0; k < block.texel_count; ++k) {
                           if (block.texels[k].weight[lane] == 0) continue;
                           const auto level = static_cast<std::size_t>(block.texels[k].level[lane]);
                           REQUIRE(level < fabrics[0].levels.size());
                           CHECK(block.texels[k].texel[lane] >= 0);
                           CHECK(block.texels[k].texel[lane] < fabrics[0].levels[level].texels());
                         }
                       });
      CHECK(seen > 300);
    }
  }
}

TEST_CASE("a band of rows is what the whole frame has there") {
  constexpr int width = 50;
  constexpr int height = 46;
  const std::vector<Fabric> fabrics{test::random_fabric(16, 16, 1)};
  Scene scene;
  test::add(scene, test::sphere(20, 10, V2d(9, 5)), test::material(0));
  const Camera camera = tilted(static_cast<double>(width) / height);
  std::vector<int> whole(static_cast<std::size_t>(width * height), -1);
  std::vector<int> bands = whole;
  const auto note = [&](std::vector<int>& to) {
    return [&](const PixelBlock& block, std::size_t lane) {
      to[block.y[lane] * width + block.x[lane]] =
          block.texels[0].level[lane] * 1000 + block.texels[0].texel[lane];
    };
  };
  test::each_pixel(test::index_nearest(scene, fabrics, camera, width, height, {}), note(whole));
  for (int first = 0; first < height; first += 12) {
    test::each_pixel(
        test::index_nearest(scene, fabrics, camera, width, height, {}, first, std::min(12, height - first)),
        note(bands));
  }
  CHECK(whole == bands);
}

}  // namespace
}  // namespace selvedge
