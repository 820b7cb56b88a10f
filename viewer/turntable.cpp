#include "viewer/turntable.h"

#include <fmt/format.h>

#include <algorithm>

#include "viewer/orbit.h"

namespace selvedge {

Result<std::vector<Camera>> turntable(std::span<const V3d> points, double aspect,
                                      const CameraOptions& options, int frames) {
  if (frames == 0) {
    const Result<Camera> camera = make_camera(points, aspect, options);
    if (!camera) return tl::unexpected(camera.error());
    return std::vector<Camera>{*camera};
  }
  std::vector<CameraOptions> views;
  double distance = 0;
  for (int i = 0; i < frames; ++i) {
    CameraOptions turned = options;
    turned.azimuth += 360.0 * i / frames;
    const Result<CameraOptions> view = start_orbit(points, aspect, turned);
    if (!view) return tl::unexpected(view.error());
    views.push_back(*view);
    distance = std::max(distance, *view->distance);
  }
  std::vector<Camera> cameras;
  for (CameraOptions& view : views) {
    view.distance = distance;
    const Result<Camera> camera = make_camera(points, aspect, view);
    if (!camera) return tl::unexpected(camera.error());
    cameras.push_back(*camera);
  }
  return cameras;
}

std::string frame_path(const std::string& path, int frame) {
  const std::size_t dot = path.find_last_of('.');
  return fmt::format("{}-{:04}{}", path.substr(0, dot), frame + 1, path.substr(dot));
}

}  // namespace selvedge
