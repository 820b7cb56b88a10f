#include "format/scene/level_bounds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "format/scene/lights.h"
#include "format/scene/scene_points.h"
#include "tests/require.h"
#include "tests/viewer/seen_levels.h"
#include "viewer/render.h"

namespace selvedge {
namespace {

using test::asked;
using test::see;
using test::Seen;
using test::seen_height;
using test::seen_width;

constexpr int width = seen_width;
constexpr int height = seen_height;

/// A fabric without its finer levels.
Fabric part_of(const Fabric& whole, int first) {
  Fabric part = whole;
  if (first == 0) return part;
  part.whole = WholeFabric{whole_texels(whole), whole.first_level() + first};
  part.levels.erase(part.levels.begin(), part.levels.begin() + first);
  return part;
}

/// A ball in cloth that is stretched, turned around and mirrored, and smaller balls around it.
Scene balls() {
  Scene scene;
  test::add(scene, test::sphere(24, 16, V2d(9, 5)), test::material(0));
  scene.materials[0].fabric->transform.rotation = 0.4;
  SceneInstance one = scene.instances[0];
  one.world = M44d(-0.3, 0, 0, 0, 0, 0.3, 0, 0, 0, 0, 0.3, 0, 1.2, 0.3, 0.2, 1);
  scene.instances.push_back(one);
  scene.fabrics.resize(1);
  return scene;
}

TEST_CASE(
    "no pixel asks for a finer or coarser level than was foreseen, and the frame is the same without the "
    "rest") {
  const Scene scene = balls();
  int left_out = 0;
  for (const V2i& size : {V2i(32, 32), V2i(24, 20), V2i(9, 64)}) {
    const Fabric whole = test::random_fabric(size.x, size.y, 7);
    for (const Projection projection : {Projection::perspective, Projection::parallel}) {
      for (const double distance : {2.0, 8.0, 40.0}) {
        for (const LevelOptions& levels :
             {LevelOptions(), best_levels, LevelOptions{false, -1, 0.5F, true}}) {
          CameraOptions options;
          options.projection = projection;
          options.look_at = V3d(0, 0, 0);
          options.distance = distance;
          options.elevation = 20;
          options.field_of_view = 60;
          const Camera camera = test::need(make_camera(std::vector<V3d>{V3d(-1), V3d(1)}, 1.25, options));
          RenderOptions look;
          look.levels = levels;
          look.width = width;
          look.height = height;
          look.lights = default_lights(camera);
          const LevelRange range = asked(scene, camera, levels, whole);
          const Seen seen = see(scene, {whole}, camera, levels);
          CHECK(seen.pixels > 3);
          CHECK(range.first <= seen.first);
          CHECK(range.last >= seen.last);
          left_out += range.first;
          Fabric part = part_of(whole, range.first);
          part.levels.resize(static_cast<std::size_t>(range.last - range.first) + 1);
          const int all = level_count(size.x, size.y);
          if (range.last - range.first + 1 < all) part.whole = WholeFabric{size, range.first, all};
          LackingLevels lacking{-1, -1};
          CHECK(asked(scene, camera, levels, part, &lacking).first == 0);
          CHECK_FALSE(lacking.any());
          const Frame full = test::need(render(scene, {whole}, camera, look));
          const Frame some = test::need(render(scene, {part}, camera, look));
          CHECK(full.pixels == some.pixels);
        }
      }
    }
  }
  CHECK(left_out > 30);
}

TEST_CASE("the shader shows a part of a fabric as the whole") {
  const Scene scene = balls();
  const Fabric whole = test::random_fabric(24, 20, 7);
  CameraOptions options;
  options.distance = 40;
  const Camera camera = test::need(make_camera(std::vector<V3d>{V3d(-1), V3d(1)}, 1.25, options));
  RenderOptions look;
  look.path = RenderPath::shader;
  look.context = ContextKind::osmesa;
  look.levels = best_levels;
  look.width = width;
  look.height = height;
  look.lights = default_lights(camera);
  const LevelRange range = asked(scene, camera, look.levels, whole);
  REQUIRE(range.first > 0);
  const Frame all = test::need(render(scene, {whole}, camera, look));
  const Frame some = test::need(render(scene, {part_of(whole, range.first)}, camera, look));
  float worst = 0;
  for (std::size_t i = 0; i < all.pixels.size(); ++i) {
    for (int c = 0; c < 4; ++c) worst = std::max(worst, std::abs(all.pixels[i][c] - some.pixels[i][c]));
  }
  CHECK(worst < 1e-5F);
}

TEST_CASE("what a part of a fabric lacks is said, and shown as finely as can be") {
  const Scene scene = balls();
  const Fabric whole = test::random_fabric(32, 32, 7);
  CameraOptions options;
  options.distance = 2.5;
  const Camera camera = test::need(make_camera(std::vector<V3d>{V3d(-1), V3d(1)}, 1.25, options));
  const LevelRange range = asked(scene, camera, best_levels, whole);
  REQUIRE(range.first < 3);
  LackingLevels lacking;
  const LevelRange of_part = asked(scene, camera, best_levels, part_of(whole, 3), &lacking);
  CHECK(of_part.first == 0);
  CHECK(lacking.finer == 3 - range.first);
  CHECK(lacking.coarser == 0);
  // Without its coarsest two levels, of which it knows, and of which it does not.
  Fabric cut = part_of(whole, 1);
  cut.levels.resize(3);
  REQUIRE(range.last == 5);
  asked(scene, camera, best_levels, cut, &lacking);
  CHECK(lacking.coarser == 0);
  cut.whole->levels = 6;
  const LevelRange of_cut = asked(scene, camera, best_levels, cut, &lacking);
  CHECK(of_cut.last == 2);
  CHECK(lacking.coarser == 2);
  CHECK(lacking.finer == std::max(1 - range.first, 0));
  test::each_pixel(test::index_nearest(scene, {part_of(whole, 3)}, camera, width, height, best_levels),
                   [&](const PixelBlock& block, std::size_t lane) {
                     float sum = 0;
                     for (std::size_t i = 0; i < block.texel_count; ++i) {
                       sum += block.texels[i].weight[lane];
                       CHECK(block.texels[i].level[lane] < 3);
                     }
                     CHECK(sum == doctest::Approx(1));
                   });
}

TEST_CASE(
    "from wherever a plan allows to look, pixels ask for its levels alone; and it is not much too fine") {
  const Scene scene = balls();
  const std::vector<Fabric> fabrics{test::random_fabric(512, 512, 3)};
  const auto points = test::need(world_points(scene));
  Random random(11);
  const double aspect = static_cast<double>(width) / height;
  for (const Projection projection : {Projection::perspective, Projection::parallel}) {
    for (const double nearest : {2.5, 4.0, 12.0}) {
      CameraOptions options;
      options.projection = projection;
      options.field_of_view = 40;
      const double farthest = 2 * nearest;
      const auto around = test::need(make_orbit(points, aspect, nearest, farthest, options));
      const std::vector<V2d> units{V2d(512, 512)};
      const PixelCover cover = pixel_covers(scene, around, height, units)[0];
      const LevelRange range = levels_asked(cover, best_levels, 10);
      const double fraction = std::log2(cover.min_size) + static_cast<double>(best_levels.bias);
      const double part = fraction - std::floor(fraction);
      const double finest = std::floor(fraction) + std::clamp(2 * (part - 0.5) + 0.5, 0.0, 1.0);
      double seen = HUGE_VAL;
      int pixels = 0;
      for (int i = 0; i < 40; ++i) {
        CameraOptions one = options;
        one.azimuth = 360 * random.uniform();
        one.elevation = 180 * random.uniform() - 90;
        one.distance = i % 2 == 0 ? nearest : nearest + (farthest - nearest) * random.uniform();
        const Camera camera = test::need(make_camera(points, aspect, one));
        const Seen levels = see(scene, fabrics, camera, best_levels);
        CHECK(range.first <= levels.first);
        CHECK(range.last >= levels.last);
        seen = std::min(seen, levels.finest);
        pixels += levels.pixels;
        // Narrower than from everywhere.
        CHECK(asked(scene, camera, best_levels, fabrics[0]).first >= range.first);
      }
      CHECK(pixels > 1000);
      CAPTURE(nearest);
      MESSAGE("finest level foreseen " << finest << ", seen " << seen);
      CHECK(finest - 1e-3 <= seen);  // what a pixel rounds
      CHECK(seen - finest < 1);
    }
  }
}

TEST_CASE("what no frame shows needs the coarsest level alone, what has no bound all of them") {
  const Scene scene = balls();
  const Fabric whole = test::random_fabric(32, 32, 7);
  CameraOptions options;
  options.look_at = V3d(0, 50, 0);
  options.distance = 3;
  const Camera camera = test::need(make_camera(std::vector<V3d>{V3d(-1), V3d(1)}, 1.25, options));
  const LevelRange range = asked(scene, camera, best_levels, whole);
  CHECK(range.first == 5);
  CHECK(range.last == 5);
  const auto points = test::need(world_points(scene));
  // The eye may stand within the ball.
  const auto around = test::need(make_orbit(points, 1.25, 0.5, 3, {}));
  const std::vector<V2d> units{V2d(32, 32)};
  const PixelCover cover = pixel_covers(scene, around, height, units)[0];
  CHECK(cover.min_size == 0);
  CHECK(levels_asked(cover, best_levels, 6).first == 0);
  CHECK(levels_asked(cover, best_levels, 6).last == 5);
  for (const V2d& distances : {V2d(0, 1), V2d(2, 1), V2d(1, HUGE_VAL), V2d(std::nan(""), 1)}) {
    CHECK(test::error_of(make_orbit(points, 1.25, distances.x, distances.y, {})).code ==
          Code::option_out_of_range);
  }
}

TEST_CASE("a demand in millimetres is met by texels of any shape") {
  const Scene scene = balls();
  const auto points = test::need(world_points(scene));
  Random random(5);
  for (int i = 0; i < 200; ++i) {
    const V2d period(1 + 9 * random.uniform(), 1 + 9 * random.uniform());
    const V2i texels(8 + static_cast<int>(40 * random.uniform()),
                     8 + static_cast<int>(40 * random.uniform()));
    const auto around = test::need(make_orbit(points, 1.25, 4 + 8 * random.uniform(), 20, {}));
    const std::vector<V2d> in_mm{period};
    const std::vector<V2d> in_texels{V2d(texels)};
    const PixelCover mm = pixel_covers(scene, around, height, in_mm)[0];
    const int levels = level_count(texels.x, texels.y);
    const LevelRange needed =
        levels_asked(pixel_covers(scene, around, height, in_texels)[0], best_levels, levels);
    const LevelRange made = levels_for({mm.min_size, mm.max_size, static_cast<double>(best_levels.bias)},
                                       period / V2d(texels), levels);
    CHECK(made.first <= needed.first);
    CHECK(made.last >= needed.last);
  }
}

}  // namespace
}  // namespace selvedge
