#include "viewer/show_picture.h"

#include <algorithm>
#include <chrono>

#include "format/fabric_exr.h"
#include "viewer/change_fabrics.h"
#include "viewer/geometry.h"
#include "viewer/orbit.h"

namespace selvedge {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

Result<std::unique_ptr<ShowPicture>> ShowPicture::create(Scene scene, std::vector<Fabric> fabrics,
                                                         MakeContext make_context) {
  const Result<std::vector<V3d>> points = world_points(scene);
  if (!points) return tl::unexpected(points.error());
  std::unique_ptr<ShowPicture> picture(new ShowPicture);
  picture->corners_ = box_corners(*points);
  picture->size_ = std::max((picture->corners_.back() - picture->corners_.front()).length(), 1e-9);
  picture->scene_ = std::move(scene);
  picture->fabrics_ = std::move(fabrics);
  for (const SceneFabric& fabric : picture->scene_.fabrics) picture->fabric_names_.push_back(fabric.name);
  picture->fabric_names_.resize(picture->fabrics_.size());
  picture->make_context_ = std::move(make_context);
  return picture;
}

Result<ShowState> ShowPicture::first_state(const CameraOptions& options, double aspect) const {
  ShowState state;
  Result<CameraOptions> orbit = start_orbit(corners_, aspect, options);
  if (!orbit) return tl::unexpected(orbit.error());
  state.camera = *orbit;
  state.fabrics = fabrics_of(scene_);
  return state;
}

Result<void> ShowPicture::add_fabric(const std::string& path) {
  Result<Fabric> fabric = read_fabric(path);
  if (!fabric) return tl::unexpected(fabric.error());
  // The renderer points to the fabrics.
  renderer_.reset();
  fabrics_.push_back(std::move(*fabric));
  fabric_names_.push_back(path.substr(path.find_last_of('/') + 1));
  return {};
}

Result<void> ShowPicture::load(const ShowState& state) {
  renderer_.reset();
  options_.path = static_cast<RenderPath>(state.path);
  // Nothing of a state before, which may have been refused.
  options_.levels = state.levels;
  options_.shadows = state.shadows;
  options_.lights.clear();
  Result<std::unique_ptr<Renderer>> renderer =
      Renderer::create(change_fabrics(scene_, fabrics_, state.fabrics), fabrics_, options_, make_context_());
  if (!renderer) return tl::unexpected(renderer.error());
  renderer_ = std::move(*renderer);
  return {};
}

Result<void> ShowPicture::draw(const ShowState& state) {
  const Clock::time_point start = Clock::now();
  const double aspect = static_cast<double>(options_.width) / options_.height;
  const Result<Camera> camera = make_camera(corners_, aspect, state.camera);
  if (!camera) return tl::unexpected(camera.error());
  camera_ = *camera;
  options_.levels = state.levels;
  options_.ambient = state.ambient;
  options_.shadows = state.shadows;
  options_.lights = lights_in_world(state, camera_);
  if (auto good = renderer_->draw(camera_, options_, frame_, stats_); !good) return good;
  draw_seconds_ = seconds_since(start);
  overlay_.clear();
  overlay_seconds_ = 0;
  if (!state.texel_edges) return {};
  const Clock::time_point overlay_start = Clock::now();
  auto good = renderer_->texel_edges(camera_, options_, overlay_);
  overlay_seconds_ = seconds_since(overlay_start);
  return good;
}

Result<void> ShowPicture::update(const ShowState& state, Change change, const V2i& size, int divisor) {
  if (change == Change::none) return {};
  options_.width = std::max(1, size.x / divisor);
  options_.height = std::max(1, size.y / divisor);
  options_.layers = state.layers;
  if (change == Change::scene || !renderer_) {
    if (auto good = load(state); !good) return good;
    change = Change::scene;
  } else if (auto good = renderer_->resize(options_); !good) {
    return good;
  }
  if (change >= Change::frame || frame_.width != options_.width || frame_.height != options_.height) {
    if (auto good = draw(state); !good) return good;
  }
  const Clock::time_point start = Clock::now();
  to_display_bytes(frame_, state.display, bytes_);
  display_seconds_ = seconds_since(start);
  return {};
}

Result<std::optional<PixelProbe>> ShowPicture::probe(const V2d& at) {
  if (!renderer_ || !(at.x >= 0 && at.x < 1 && at.y >= 0 && at.y < 1)) return std::nullopt;
  const V2i pixel(static_cast<int>(at.x * frame_.width), static_cast<int>(at.y * frame_.height));
  return renderer_->probe(camera_, options_, pixel);
}

}  // namespace selvedge
