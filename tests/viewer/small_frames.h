// Pictures of the smallest scenes, for the tests of render().
#pragma once

#include <utility>
#include <vector>

#include "tests/require.h"
#include "tests/viewer/shapes.h"
#include "viewer/renderer.h"

namespace selvedge::test {

inline Camera camera_for(const Scene& scene, const RenderOptions& options,
                         const CameraOptions& camera_options = {}) {
  const auto points = need(world_points(scene));
  return need(make_camera(points, static_cast<double>(options.width) / options.height, camera_options));
}

inline Frame render_or_fail(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
                            const RenderOptions& options, RenderStats* stats = nullptr) {
  const Frame frame = need(render(scene, fabrics, camera, options, stats));
  REQUIRE(frame.pixels.size() == static_cast<std::size_t>(options.width * options.height));
  return frame;
}

inline RenderOptions small(std::vector<Light> lights) {
  RenderOptions options;
  options.width = 120;
  options.height = 100;
  options.lights = std::move(lights);
  return options;
}

inline const Light from_the_side{V3d(0.48, 0.6, 0.64), V3f(3, 2, 1)};

inline V4f middle(const Frame& frame) {
  return frame.pixels[frame.height / 2 * frame.width + frame.width / 2];
}

}  // namespace selvedge::test
