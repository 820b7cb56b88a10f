// Moving frames: patches have no visible borders, and nothing flickers, beside rays through the yarn.
#include <doctest/doctest.h>

#include <algorithm>

#include "format/fabric/file.h"
#include "format/picture/environment.h"
#include "tests/require.h"
#include "tests/viewer/paths.h"
#include "tests/viewer/rays.h"
#include "viewer/cells/patches.h"
#include "viewer/light/shadows.h"
#include "viewer/renderer.h"

namespace selvedge {
namespace {

constexpr V2d repeats(120, 60);

/// A sphere of yarn.
test::Setting yarn_ball(int width, int height) {
  test::Setting setting;
  test::add(setting.scene, test::sphere(64, 32, repeats), test::material(0));
  setting.fabrics = {test::need(read_fabric(SELVEDGE_SOURCE_DIR "/tests/data/kept/4.0/yarn.fabric.exr"))};
  setting.options.width = width;
  setting.options.height = height;
  setting.options.context = ContextKind::osmesa;
  setting.options.layers = 2;
  setting.camera.elevation = 20;
  setting.options.lights = default_lights(test::camera_of(setting));
  return setting;
}

/// Mean of the colours on a display, by pixels.
std::vector<double> grey(const Frame& frame) {
  std::vector<double> result;
  for (const V4f& p : frame.pixels)
    result.push_back((test::shown(p.x) + test::shown(p.y) + test::shown(p.z)) / 3);
  return result;
}

/// Frames for cameras.
std::vector<std::vector<double>> drawn(test::Setting setting, std::span<const CameraOptions> cameras) {
  setting.options.path = RenderPath::raster;
  setting.options.cells = moving_cell_images;
  const auto renderer = test::need(Renderer::create(setting.scene, setting.fabrics, setting.options));
  std::vector<std::vector<double>> frames;
  for (const CameraOptions& camera : cameras) {
    setting.camera = camera;
    Frame frame;
    RenderStats stats;
    test::need(renderer->draw(test::camera_of(setting), setting.options, frame, stats));
    frames.push_back(grey(frame));
  }
  return frames;
}

/// The same of rays.
std::vector<std::vector<double>> marched(test::Setting setting, std::span<const CameraOptions> cameras) {
  std::vector<std::vector<double>> frames;
  for (const CameraOptions& camera : cameras) {
    setting.camera = camera;
    frames.push_back(
        grey(test::march(setting.scene, setting.fabrics, test::camera_of(setting),
                         {setting.options.width, setting.options.height}, setting.options.lights)));
  }
  return frames;
}

double percentile(std::vector<double>& values, double fraction) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Patches of a mesh in one fabric.
Patches patches_of(const MergedSurfaces& mesh) {
  return {mesh, std::vector{SurfaceMaterial{.fabric = 0}}, std::vector{PatchFabric{.relief = 0.2F}}};
}

}  // namespace

TEST_CASE(
    "patches of frames that move merge at 0.8 of the limit at which they split; others have no history") {
  test::Setting setting = yarn_ball(240, 180);
  const V3d origin(0, 0, 0);
  const MergedSurfaces mesh = merge(test::need(build_surfaces(setting.scene, origin)));
  Patches moved = patches_of(mesh);
  const auto chosen = [&](Patches& patches, double zoom, bool moves) {
    setting.camera.zoom = zoom;
    patches.choose(test::camera_of(setting), origin, V2i(240, 180),
                   {.max_side_pixels = 16,
                    .max_side_repeats = 720,
                    .max_turn_degree_pixels = 1e9F,
                    .max_turn_degrees = 180,
                    .max_outline_pixels = 1e9F},
                   {}, moves);
    return std::vector<std::uint32_t>(patches.table().begin(), patches.table().end());
  };
  const auto fresh = [&](double zoom) {
    Patches patches = patches_of(mesh);
    return chosen(patches, zoom, false);
  };
  const auto near = chosen(moved, 1, true);
  CHECK(near == fresh(1));
  CHECK(near != fresh(1 / 1.2));
  CHECK(chosen(moved, 1 / 1.2, true) == near);
  CHECK(chosen(moved, 1 / 1.3, true) != near);
  CHECK(chosen(moved, 1, true) == near);
  CHECK(chosen(moved, 1 / 1.2, false) == fresh(1 / 1.2));
}

TEST_CASE("borders of patches are no more wrong than the yarn within them") {
  test::Setting setting = yarn_ball(240, 180);
  const std::vector<double> frame = drawn(setting, std::span(&setting.camera, 1)).front();
  const std::vector<double> rays = marched(setting, std::span(&setting.camera, 1)).front();
  const Camera camera = test::camera_of(setting);
  const V3d origin(0, 0, 0);
  const MergedSurfaces mesh = merge(test::need(build_surfaces(setting.scene, origin)));
  Patches patches = patches_of(mesh);
  const V2i size(setting.options.width, setting.options.height);
  // Finer ones than the frame's.
  patches.choose(camera, origin, size,
                 {.max_side_pixels = 128, .max_side_repeats = 720, .max_turn_degrees = 0},
                 setting.options.lights);
  const V2f first(mesh.attributes[mesh.triangles[0].corners[0]][0][3],
                  mesh.attributes[mesh.triangles[0].corners[0]][1][3]);
  const auto patch_at = [&](int x, int y) -> std::int64_t {
    const V2d place = camera.window_centre +
                      camera.window_half_size * V2d((2.0 * x + 1) / size.x - 1, 1 - (2.0 * y + 1) / size.y);
    const V3d d = (camera.right * place.x + camera.up * place.y - camera.image_normal()).normalized();
    const double b = d.dot(camera.position);
    const double h = b * b - camera.position.length2() + 1;
    // Not near the outline, where a pixel's rays meet many repeats.
    if (h < 0.1) return -1;
    const V3d n = camera.position + d * (-b - std::sqrt(h));
    if (std::abs(n.y) > 0.8) return -1;
    const double turn = std::atan2(n.x, n.z) / (2 * std::numbers::pi);
    const V2d uv((turn < 0 ? turn + 1 : turn) * repeats.x, std::acos(n.y) / std::numbers::pi * repeats.y);
    const auto unit = [&](double at, float from) {
      return patches.unit_at(static_cast<int>(std::floor(at) - std::floor(static_cast<double>(from))),
                             static_cast<float>(at - std::floor(at)));
    };
    return patches.patch_at(patches.place(0), unit(uv.x, first.x), unit(uv.y, first.y));
  };
  std::vector<double> borders;
  std::vector<double> inside;
  for (int y = 0; y + 1 < size.y; ++y) {
    for (int x = 0; x + 1 < size.x; ++x) {
      const std::int64_t here = patch_at(x, y);
      for (const int other : {1, size.x}) {
        const std::int64_t there = other == 1 ? patch_at(x + 1, y) : patch_at(x, y + 1);
        if (here < 0 || there < 0) continue;
        const int i = y * size.x + x;
        (here == there ? inside : borders)
            .push_back(std::abs((frame[i + other] - frame[i]) - (rays[i + other] - rays[i])));
      }
    }
  }
  REQUIRE(borders.size() > 1000);
  MESSAGE(borders.size(), " of ", inside.size(),
          " lie on borders; differences of gradients of 255: ", percentile(borders, 0.5), " ",
          percentile(borders, 0.99), " ", percentile(borders, 0.999), "; inside ", percentile(inside, 0.5),
          " ", percentile(inside, 0.99), " ", percentile(inside, 0.999));
  // Without the factor of a pixel's own light (CellLook::brightness) the ratios are 1.28 and 1.34.
  CHECK(percentile(borders, 0.99) <= 1.2 * percentile(inside, 0.99));
  CHECK(percentile(borders, 0.999) <= 1.25 * percentile(inside, 0.999));
}

TEST_CASE("an orbit and a slow zoom change as smoothly as rays do") {
  for (const bool zooms : {false, true}) {
    const test::Setting setting = yarn_ball(96, 72);
    std::vector<CameraOptions> cameras(14, setting.camera);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const auto step = static_cast<double>(i);
      if (zooms)
        cameras[i].zoom = 1 + 0.004 * step;
      else
        cameras[i].azimuth = 0.25 * step;
    }
    const auto second_difference = [](const std::vector<std::vector<double>>& frames) {
      double sum = 0;
      double count = 0;
      for (std::size_t t = 1; t + 1 < frames.size(); ++t) {
        for (std::size_t i = 0; i < frames[t].size(); ++i) {
          sum += std::abs(frames[t - 1][i] - 2 * frames[t][i] + frames[t + 1][i]);
          ++count;
        }
      }
      return sum / count;
    };
    const double of_frames = second_difference(drawn(setting, cameras));
    const double of_rays = second_difference(marched(setting, cameras));
    MESSAGE("mean second difference ", of_frames, " of 255, of rays ", of_rays);
    CHECK(of_frames <= 1.3 * of_rays + 0.5);
  }
}

TEST_CASE("light from all sides waits while a shape moves, and is as fresh as at the start once it rests") {
  test::Setting setting = yarn_ball(96, 72);
  test::add(setting.scene, test::sphere(64, 32, repeats), test::material(0));
  const auto place_second = [&](double height) {
    setting.scene.instances[1].world.setTranslation(V3d(0, height, 0));
  };
  place_second(4);
  setting.options.lights.clear();
  setting.options.smooth_light = split_light(studio_environment()).smooth_light;
  setting.options.shadow_map_size = min_shadow_size;
  const auto create = [&] {
    return test::need(Renderer::create(setting.scene, setting.fabrics, setting.options));
  };
  const auto draw = [&](Renderer& renderer, bool moves) {
    DrawOptions options = setting.options;
    if (moves) options.cells = moving_cell_images;
    options.cells.remade_fraction = 1;
    Frame frame;
    RenderStats stats;
    test::need(renderer.draw(test::camera_of(setting), options, frame, stats));
    return frame.pixels;
  };
  const auto moved = create();
  draw(*moved, true);
  place_second(1.2);
  test::need(moved->replace(setting.scene));
  const auto fresh = create();
  CHECK(draw(*moved, true) != draw(*fresh, true));
  const auto rested = draw(*moved, false);
  CHECK(rested == draw(*fresh, false));
  CHECK(rested == draw(*moved, false));
}

}  // namespace selvedge
