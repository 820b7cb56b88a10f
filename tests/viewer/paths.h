// A scene drawn by a path, and by rays.
#pragma once

#include <algorithm>
#include <cmath>

#include "format/scene/swatch.h"
#include "tests/require.h"
#include "tests/viewer/rays.h"
#include "tests/viewer/shapes.h"
#include "viewer/renderer.h"

namespace selvedge::test {

struct Setting {
  Scene scene;
  std::vector<Fabric> fabrics;
  CameraOptions camera;
  RenderOptions options;
};

inline Camera camera_of(const Setting& setting) {
  const auto points = need(world_points(setting.scene));
  return need(make_camera(points, static_cast<double>(setting.options.width) / setting.options.height,
                          setting.camera));
}

inline Frame drawn(const Setting& setting, RenderPath path) {
  const Camera camera = camera_of(setting);
  RenderOptions options = setting.options;
  options.path = path;
  options.context = ContextKind::osmesa;
  return need(render(setting.scene, setting.fabrics, camera, options));
}

/// Colours of a picture on an 8-bit display, premultiplied.
inline double shown(float linear) {
  const double x = std::clamp(static_cast<double>(linear) * 3.14159265, 0.0, 1.0);
  return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055);
}

/// PSNR in dB of a picture to a mean of `larger` x `larger` pixels of another one, colours and opacity.
inline double decibels(const Frame& frame, const Frame& fine, int larger) {
  double sum = 0;
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      V4f mean(0, 0, 0, 0);
      for (int k = 0; k < larger * larger; ++k)
        mean += fine.pixels[(y * larger + k / larger) * fine.width + x * larger + k % larger];
      mean /= static_cast<float>(larger * larger);
      const V4f& p = frame.pixels[y * frame.width + x];
      for (int c = 0; c < 3; ++c) sum += std::pow(shown(p[c]) - shown(mean[c]), 2);
      sum += std::pow(255 * static_cast<double>(p.w - mean.w), 2);
    }
  }
  return 10 * std::log10(255 * 255 * 4.0 * static_cast<double>(frame.pixels.size()) / std::max(sum, 1e-9));
}

/// Compares the hybrid path's picture to rays (rays.h). At least an eighth of the frame shows something.
inline double decibels_to_rays(Setting setting) {
  // The outlines of rays are smooth.
  setting.options.supersample = 4;
  const RenderOptions& options = setting.options;
  const Frame frame = drawn(setting, RenderPath::hybrid);
  const auto covered =
      std::count_if(frame.pixels.begin(), frame.pixels.end(), [](const V4f& p) { return p.w > 0; });
  CHECK(covered > static_cast<std::ptrdiff_t>(frame.pixels.size() / 8));
  const double db =
      decibels(frame,
               march(setting.scene, setting.fabrics, camera_of(setting), {options.width, options.height},
                     options.lights, options.shadow_map_size, options.layers, options.levels.forced_level),
               1);
  MESSAGE("hybrid to rays: ", db, " dB");
  return db;
}

/// dB of a picture of a swatch against rays; `level`: of march().
inline double swatch_decibels(const Fabric& fabric, const SwatchShot& shot, int level) {
  const Scene scene = swatch_scene(V2d(fabric.period_mm), shot);
  RenderOptions options;
  options.context = ContextKind::osmesa;
  options.width = shot.width;
  options.height = shot.height;
  options.layers = 1;
  options.lights = shot.lights;
  return decibels(
      need(render(scene, {fabric}, shot.camera, options)),
      march(scene, {&fabric, 1}, shot.camera, {shot.width, shot.height}, shot.lights, 0, 1, level), 1);
}

}  // namespace selvedge::test
