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

/// log2 of the width of a square of the pixel's area, which counts as at least an eighth of the squared
/// longer singular value of the 2 x 2 matrix of slopes.
double expected_level(const V2d& right, const V2d& up) {
  const double sum = right.length2() + up.length2();
  const double det = std::abs(right.x * up.y - right.y * up.x);
  const double long2 = (sum + std::sqrt(std::max(0.0, sum * sum - 4 * det * det))) / 2;
  return 0.5 * std::log2(std::max(det, long2 / 8));
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
    const double by_area = std::clamp(expected_level(right, up), 0.0, last);
    const double part = by_area - std::floor(by_area);
    const double level = std::floor(by_area) + std::clamp(2 * (part - 0.5) + 0.5, 0.0, 1.0);
    bool counts = true;
    bool good = block.surface[lane] == triangle.surface;
    for (std::size_t k = 0; k < block.texel_count && good; ++k) {
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

TEST_CASE("texels and levels agree with a ray through the pixel, on 99.9 % of the pixels off the edges") {
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
      CHECK(a.worst_level < 5e-3);
    }
    Scene scene;
    test::add(scene, test::sphere(24, 12, V2d(30, 15)), test::material(0));
    const std::vector<V3d> points{V3d(-1, -1, -1), V3d(1, 1, 1)};
    const Camera& camera = test::need(make_camera(points, static_cast<double>(width) / height, {}));
    const Agreement a =
        compare_to_rays(test::index_nearest(scene, fabrics, camera, width, height, {}), fabrics, camera, 1);
    CHECK(a.compared > 5000);
    CHECK(a.wrong * 1000 <= a.compared);
    CHECK(a.worst_level < 5e-3);
  }
}

/// The shares of the texels around a pixel at `centre`, [row][column] of a grid of `side` texels; sum 1.
std::vector<double> shares(const TexelSlopes<float>& slopes, const V2d& centre, int side) {
  const PixelBox<float> box = pixel_box(slopes, pixel_size(slopes));
  std::vector<double> result;
  double sum = 0;
  for (int i = 0; i < side * side; ++i) {
    const V2f away(V2d(i % side + 0.5, i / side + 0.5) - centre);
    CHECK((texel_share(box, away.x, away.y) == 0 || std::abs(away.x) < box.reach_x));
    CHECK((texel_share(box, away.x, away.y) == 0 || std::abs(away.y) < box.reach_y));
    result.push_back(static_cast<double>(texel_share(box, away.x, away.y)));
    sum += result.back();
  }
  for (double& share : result) share /= sum;
  return result;
}

TEST_CASE("the shares of texels are their areas under a pixel that lies as they do") {
  Random random(4);
  for (int i = 0; i < 200; ++i) {
    const V2d size(1 + 2.2 * random.uniform(), 1 + 2.2 * random.uniform());
    const V2d centre(8 + random.uniform(), 8 + random.uniform());
    const auto found = shares({static_cast<float>(size.x), 0, 0, static_cast<float>(-size.y)}, centre, 16);
    const auto overlap = [](double first, double middle, double width) {
      return std::max(std::min(first + 1, middle + width / 2) - std::max(first, middle - width / 2), 0.0);
    };
    for (int k = 0; k < 256; ++k) {
      CHECK(found[k] == doctest::Approx(overlap(k % 16, centre.x, size.x) *
                                        overlap(k / 16, centre.y, size.y) / (size.x * size.y))
                            .epsilon(1e-4));
    }
  }
}

TEST_CASE("under a turned pixel a few per cent of the area go to a texel beside the right one") {
  Random random(5);
  double sum = 0;
  double worst = 0;
  constexpr int pixels = 300;
  for (int i = 0; i < pixels; ++i) {
    const double angle = 2 * 3.14159265 * random.uniform();
    const double wide = 1.4 + 1.4 * random.uniform();
    const double high = wide * (0.5 + 0.5 * random.uniform());
    const V2d right = wide * V2d(std::cos(angle), std::sin(angle));
    const V2d up = high * V2d(-std::sin(angle), std::cos(angle));
    const V2d centre(8 + random.uniform(), 8 + random.uniform());
    const V2f r(right);
    const V2f u(up);
    const std::vector<double> found = shares({r.x, r.y, u.x, u.y}, centre, 16);
    std::vector<double> area(256);
    constexpr int points = 100;
    for (int k = 0; k < points * points; ++k) {
      const V2d at =
          centre + right * ((k % points + 0.5) / points - 0.5) + up * ((k / points + 0.5) / points - 0.5);
      area[static_cast<int>(at.y) * 16 + static_cast<int>(at.x)] += 1.0 / (points * points);
    }
    double wrong = 0;
    for (int k = 0; k < 256; ++k) wrong += std::abs(area[k] - found[k]) / 2;
    sum += wrong;
    worst = std::max(worst, wrong);
  }
  MESSAGE("on the average " << sum / pixels << ", at most " << worst);
  CHECK(sum / pixels < 0.06);
  CHECK(worst < 0.15);
}

TEST_CASE("what a pixel's coordinates do not tell is level 0") {
  CHECK(std::log2(pixel_size(TexelSlopes<float>{0, 0, 0, 0})) < 0);
  const PixelBox<float> box = pixel_box(TexelSlopes<float>{0, 0, 0, 0}, 1e-12F);
  CHECK(texel_share(box, 0.0F, 0.0F) == 1);
}

TEST_CASE("pixels smaller than a texel show the texels around, by their distance") {
  const PixelBox<float> box = pixel_box(TexelSlopes<float>{0.01F, 0, 0, 0.01F}, 0.01F);
  for (const V2f& away : {V2f(0.2F, -0.7F), V2f(0, 0), V2f(-0.9F, 0.4F), V2f(1.1F, 0)}) {
    const float expected = std::max(1 - std::abs(away.x), 0.0F) * std::max(1 - std::abs(away.y), 0.0F);
    CHECK(texel_share(box, away.x, away.y) == doctest::Approx(expected));
  }
}

TEST_CASE("the weights of a pixel's texels sum to 1, at any angle and size") {
  const std::vector<Fabric> fabrics{test::random_fabric(32, 24, 1)};
  for (const double elevation : {0.0, 75.0, 89.0}) {
    Scene scene;
    test::add(scene, test::square(20), test::material(0));
    CameraOptions options;
    options.elevation = elevation;
    options.azimuth = 30;
    const std::vector<V3d> points{V3d(-1, -1, 0), V3d(1, 1, 0)};
    const Camera camera = test::need(make_camera(points, 1, options));
    std::size_t most = 0;
    test::each_pixel(test::index_nearest(scene, fabrics, camera, 100, 100, best_levels),
                     [&](const PixelBlock& block, std::size_t lane) {
                       float sum = 0;
                       for (std::size_t k = 0; k < block.texel_count; ++k) {
                         CHECK(block.texels[k].weight[lane] >= 0);
                         sum += block.texels[k].weight[lane];
                       }
                       CHECK(sum == doctest::Approx(1));
                       most = std::max(most, block.texel_count);
                     });
    CHECK(most > 4);
  }
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
                         for (std::size_t k = 0; k < block.texel_count; ++k) {
                           CHECK(block.texels[k].level[lane] <= 1);
                           const float weight = block.texels[k].weight[lane];
                           if (!blend) CHECK((weight == 0 || weight == 1));
                         }
                       });
      CHECK(seen > 1000);
    }
  }
}

TEST_CASE("texture coordinates that overflow still name a texel") {
  const std::vector<Fabric> fabrics{test::random_fabric(8, 8, 1)};
  for (const double repeats : {1e12, 1e30, 3e38}) {
    for (const bool area : {false, true}) {
      Scene scene;
      test::add(scene, test::square(repeats), test::material(0));
      LevelOptions levels;
      levels.area = area;
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

}  // namespace
}  // namespace selvedge
