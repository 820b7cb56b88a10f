#include "viewer/show/picture.h"

#include <algorithm>
#include <cmath>

#include "format/base/guard.h"
#include "format/scene/framing.h"
#include "viewer/accuracy.h"
#include "viewer/orbit.h"
#include "viewer/scene/change_fabrics.h"

namespace selvedge {

Result<std::unique_ptr<ShowPicture>> ShowPicture::create(Scene scene, std::vector<Fabric> fabrics,
                                                         std::optional<Motion> motion) {
  const Result<std::vector<V3d>> points = world_points(scene);
  if (!points) return tl::unexpected(points.error());
  std::unique_ptr<ShowPicture> picture(new ShowPicture);
  picture->corners_ = box_corners(*points);
  picture->drawn_.scene_diagonal =
      std::max((picture->corners_.back() - picture->corners_.front()).length(), 1e-9);
  picture->scene_ = std::move(scene);
  picture->fabrics_ = std::move(fabrics);
  picture->scene_.fabrics.resize(picture->fabrics_.size());
  picture->motion_ = std::move(motion);
  if (!picture->motion_) return picture;
  picture->drawn_.clips = picture->motion_->names();
  picture->drawn_.clip_seconds = picture->motion_->clip().seconds();
  return picture->motion_->pose(0, picture->scene_).map([&] { return std::move(picture); });
}

Result<ShowState> ShowPicture::first_state(const CameraOptions& options, double aspect) const {
  ShowState state;
  if (motion_) state.clip = 0;
  state.worn_fabrics.fabrics = fabrics_of(scene_);
  state.worn_fabrics.fits.resize(scene_.materials.size());
  CameraOptions turned = options;
  if (options.azimuth == 0 && options.elevation == 0) {
    const Result<Framing> framing = frame_scene(scene_);
    if (!framing) return tl::unexpected(framing.error());
    turned.azimuth = framing->azimuth;
    turned.elevation = framing->elevation;
  }
  return start_orbit(corners_, aspect, turned).map([&](const CameraOptions& orbit) {
    state.camera = orbit;
    return state;
  });
}

Result<void> ShowPicture::add_fabric(const std::string& path) {
  Result<Fabric> fabric = read_fabric(path, {.memory = scene_.memory_left});
  if (!fabric) return tl::unexpected(fabric.error());
  drop_renderers();
  fabrics_.push_back(std::move(*fabric));
  SceneFabric& source = scene_.fabrics.emplace_back();
  source.name = path.substr(path.find_last_of('/') + 1);
  source.path = path;
  return {};
}

void ShowPicture::load(const ShowState& state) {
  drop_renderers();
  two_ = state.compared_fabrics.has_value();
  options_.path = static_cast<RenderPath>(state.path);
  // Starts from defaults, as the previous state may have been refused.
  options_.levels = state.levels;
  set_light(state);
  options_.lights.clear();
  load(state.worn_fabrics, sides_[0]);
  if (two_) load(*state.compared_fabrics, sides_[1]);
}

/// Moves everything to the time of the state.
void ShowPicture::pose(const ShowState& state) {
  is_posed_ = false;
  if (!motion_ || (state.clip == posed_clip_ && state.clip_time == posed_time_)) return;
  is_posed_ = true;
  if (state.clip != posed_clip_) value_or_throw(motion_->choose(std::to_string(state.clip)));
  posed_clip_ = state.clip;
  posed_time_ = state.clip_time;
  drawn_.clip_seconds = motion_->clip().seconds();
  value_or_throw(motion_->pose(state.clip_time, scene_));
  if (!sides_[0].renderer) return;
  for (ShownSide& side : sides()) {
    dress(&side == &sides_[0] ? state.worn_fabrics : *state.compared_fabrics, side);
    value_or_throw(side.renderer->replace(side.dressed_scene));
  }
}

void ShowPicture::dress(const FabricChoice& choice, ShownSide& side) const {
  side.dressed_scene = change_fabrics(scene_, fabrics_, choice.fabrics);
  fit_fabrics(choice.fits, fabrics_, side.dressed_scene);
  side.dressed_scene.memory_left = scene_.memory_left / (two_ ? sides_.size() : 1);
}

void ShowPicture::load(const FabricChoice& choice, ShownSide& side) {
  dress(choice, side);
  side.renderer = value_or_throw(Renderer::create(side.dressed_scene, fabrics_, options_));
}

/// All light but the lamps.
void ShowPicture::set_light(const ShowState& state) {
  options_.environment.reset();
  options_.backdrop_roughness = -1;
  options_.shadow_map_size = state.shadow_map_size;
  options_.smooth_light = smooth_light_in_world(state);
  options_.mirrored_ambient_irradiance = state.ambient_irradiance;
  if (state.environment < 0) return;
  const Surroundings& shown = *state.environments[state.environment];
  if (turned_of_ != &shown) turned_ = std::make_shared<Environment>(shown.environment);
  turned_of_ = &shown;
  turned_->options = {static_cast<double>(state.environment_turn),
                      static_cast<double>(state.environment_strength)};
  options_.environment = turned_;
  if (state.has_backdrop) options_.backdrop_roughness = state.backdrop_roughness;
}

void ShowPicture::draw(const ShowState& state) {
  const Stopwatch watch;
  drawn_.camera = value_or_throw(make_camera(corners_, aspect_, state.camera));
  if (motion_) widen_clipping_depths(box_corners(value_or_throw(world_points(scene_))), drawn_.camera);
  options_.levels = state.levels;
  options_.cells = moving_cell_images;
  // All yarn turns, not what a camera passes.
  if (is_posed_) options_.cells.remade_fraction = 1;
  options_.cells.memory_bytes = state.image_memory_bytes / sides().size();
  set_light(state);
  options_.lights = drawn_.lights = lights_in_world(state, drawn_.camera);
  for (ShownSide& side : sides()) {
    RenderStats beside;
    RenderStats& stats = &side == &sides_[0] ? drawn_.stats : beside;
    value_or_throw(side.renderer->draw(drawn_.camera, options_, side.frame, stats));
  }
  drawn_.draw_seconds = watch.seconds();
  drawn_.accuracy_db = 0;
  refined_ = 0;
}

/// Turns what was drawn into bytes.
void ShowPicture::display(const ShowState& state) {
  bar_ = state.comparison_bar;
  if (two_) {
    const auto& [worn, beside] = sides_;
    const auto width = static_cast<std::size_t>(worn.frame.width);
    const auto left = static_cast<std::size_t>(std::lround(bar_ * static_cast<float>(width)));
    divided_.width = worn.frame.width;
    divided_.height = worn.frame.height;
    divided_.pixels = worn.frame.pixels;
    for (std::size_t begin = 0; begin < divided_.pixels.size(); begin += width)
      std::copy_n(beside.frame.pixels.data() + begin, left, divided_.pixels.data() + begin);
  }
  to_display_bytes(frame(), state.display, drawn_.bytes);
  drawn_.width = frame().width;
  drawn_.height = frame().height;
}

Result<void> ShowPicture::update(const ShowState& state, Redraw change, const V2i& size, double divisor,
                                 const std::atomic<bool>* interrupted) {
  if (change == Redraw::none) return {};
  options_.interrupt_flag = interrupted;
  aspect_ = static_cast<double>(size.x) / size.y;
  options_.width = std::max(1, static_cast<int>(std::lround(size.x / divisor)));
  options_.height = std::max(1, static_cast<int>(std::lround(size.y / divisor)));
  options_.layers = state.layers;
  return catch_failure([&] {
    if (change == Redraw::scene) drop_renderers();
    pose(state);
    if (change == Redraw::scene || !sides_[0].renderer) {
      load(state);
      change = Redraw::scene;
    } else {
      for (ShownSide& side : sides()) value_or_throw(side.renderer->resize(options_));
    }
    const Frame& last = sides_[0].frame;
    if (change >= Redraw::frame || last.width != options_.width || last.height != options_.height)
      draw(state);
    if (!options_.is_interrupted()) display(state);
  });
}

Result<bool> ShowPicture::refine(const ShowState& state, const std::atomic<bool>* interrupted) {
  constexpr int n = rest_samples_per_side;
  options_.interrupt_flag = interrupted;
  if (!sides_[0].renderer || options_.path > RenderPath::raster || refined_ == n * n) return false;
  RenderOptions options = options_;
  options.levels.footprint_pixels = 1.0F / n;
  options.cells = {};
  options.cells.memory_bytes = options_.cells.memory_bytes;
  Camera camera = drawn_.camera;
  const int row = refined_ / n;
  const V2d place((refined_ % n + 0.5) / n - 0.5, (row + 0.5) / n - 0.5);
  camera.window_centre += place * camera.window_half_size * 2.0 / V2d(options.width, options.height);
  RenderStats stats;
  for (ShownSide& side : sides()) {
    if (auto good = side.renderer->draw(camera, options, side.sample, stats); !good)
      return tl::unexpected(good.error());
    if (options_.is_interrupted()) return false;
    drawn_.stats.remarks = stats.remarks;
  }
  ++refined_;
  for (ShownSide& side : sides()) {
    if (refined_ == 1) {
      side.first = side.frame;
      side.samples.assign(side.frame.pixels.size(), V4f(0, 0, 0, 0));
    }
    for (std::size_t i = 0; i < side.samples.size(); ++i) {
      side.samples[i] += side.sample.pixels[i];
      side.frame.pixels[i] = (side.samples[i] + side.first.pixels[i] * static_cast<float>(n * n - refined_)) /
                             static_cast<float>(n * n);
    }
  }
  if (refined_ == n * n) drawn_.accuracy_db = frame_psnr_db(sides_[0].first, sides_[0].frame, state.display);
  display(state);
  return true;
}

Result<std::optional<PixelProbe>> ShowPicture::probe_surface(const V2d& point) {
  if (!sides_[0].renderer || !(point.x >= 0 && point.x < 1 && point.y >= 0 && point.y < 1))
    return std::nullopt;
  const V2i pixel(static_cast<int>(point.x * frame().width), static_cast<int>(point.y * frame().height));
  const bool beside = two_ && point.x < static_cast<double>(bar_);
  return sides_[beside ? 1 : 0].renderer->probe_surface(drawn_.camera, options_, pixel);
}

}  // namespace selvedge
