#include "viewer/show/picture.h"

#include <algorithm>
#include <chrono>

#include "format/fabric/file.h"
#include "viewer/orbit.h"
#include "viewer/paper/limits.h"
#include "viewer/scene/change_fabrics.h"
#include "viewer/scene/surfaces.h"

namespace selvedge {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

Result<std::unique_ptr<ShowPicture>> ShowPicture::create(Scene scene, std::vector<Fabric> fabrics) {
  const Result<std::vector<V3d>> points = world_points(scene);
  if (!points) return tl::unexpected(points.error());
  std::unique_ptr<ShowPicture> picture(new ShowPicture);
  picture->corners_ = box_corners(*points);
  picture->size_ = std::max((picture->corners_.back() - picture->corners_.front()).length(), 1e-9);
  picture->scene_ = std::move(scene);
  picture->fabrics_ = std::move(fabrics);
  for (const SceneFabric& fabric : picture->scene_.fabrics) picture->fabric_names_.push_back(fabric.name);
  picture->fabric_names_.resize(picture->fabrics_.size());
  return picture;
}

Result<std::unique_ptr<ShowPicture>> ShowPicture::create(OpenScene open) {
  // The smallest part of each file that is a valid fabric.
  std::vector<LevelRange> coarsest;
  for (const FabricReader& reader : open.readers) {
    const int last = reader.header().levels - 1;
    coarsest.push_back({last, last});
  }
  auto fabrics = read_fabrics(open, coarsest);
  if (!fabrics) return tl::unexpected(fabrics.error());
  auto picture = create(std::move(open.scene), std::move(*fabrics));
  if (!picture) return picture;
  // The readers refer to the scene's bytes, which do not move with it.
  (*picture)->readers_ = std::move(open.readers);
  (*picture)->file_bytes_ = open.file_bytes;
  (*picture)->memory_ = open.memory;
  return picture;
}

std::uint64_t ShowPicture::bytes_read() const {
  std::uint64_t sum = 0;
  for (const FabricReader& reader : readers_) sum += reader.bytes_read();
  return sum;
}

Result<ShowState> ShowPicture::first_state(const CameraOptions& options, double aspect) const {
  ShowState state;
  Result<CameraOptions> orbit = start_orbit(corners_, aspect, options);
  if (!orbit) return tl::unexpected(orbit.error());
  state.camera = *orbit;
  state.fabrics = fabrics_of(scene_);
  state.fits.resize(scene_.materials.size());
  return state;
}

Result<void> ShowPicture::add_fabric(const std::string& path) {
  Result<Fabric> fabric = read_fabric(path, {.memory = memory_.left()});
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
  dressed_ = change_fabrics(scene_, fabrics_, state.fabrics);
  fit_fabrics(state.fits, fabrics_, dressed_);
  dressed_.memory_left = memory_.left();
  // Starts from defaults, as the previous state may have been refused.
  options_.levels = state.levels;
  set_light(state);
  options_.lights.clear();
  Result<std::unique_ptr<Renderer>> renderer = Renderer::create(dressed_, fabrics_, options_);
  if (!renderer) return tl::unexpected(renderer.error());
  renderer_ = std::move(*renderer);
  return {};
}

/// All light but the lamps. The paper's path has lamps alone.
void ShowPicture::set_light(const ShowState& state) {
  options_.shadows = 0;
  options_.around.reset();
  options_.environment.reset();
  options_.backdrop = -1;
  if (options_.path == RenderPath::paper) return;
  options_.shadows = state.shadows;
  options_.around = around_in_world(state);
  options_.ambient = state.ambient;
  if (state.environment < 0) return;
  const Surroundings& shown = *state.environments[state.environment];
  if (turned_of_ != &shown) turned_ = std::make_shared<Environment>(shown.environment);
  turned_of_ = &shown;
  turned_->options = {static_cast<double>(state.turn), static_cast<double>(state.strength)};
  options_.environment = turned_;
  if (state.backdrop) options_.backdrop = state.backdrop_blur;
}

namespace {

/// Puts levels before those of a fabric, on all its sides.
void add_finer(Fabric& fabric, const Fabric& finer, const std::optional<WholeFabric>& whole) {
  fabric.levels.insert(fabric.levels.begin(), finer.levels.begin(), finer.levels.end());
  fabric.whole = whole;
  for (std::size_t i = 0; i < finer.sides.size(); ++i) {
    if (!finer.sides[i]) continue;
    Fabric side = *fabric.sides[i];
    add_finer(side, *finer.sides[i], whole);
    fabric.sides[i] = std::make_shared<const Fabric>(std::move(side));
  }
}

}  // namespace

/// Reads the levels that a picture of so many rows needs and that are not read yet.
Result<void> ShowPicture::read_levels(const ShowState& state, int rows) {
  // Added files are read whole.
  std::vector<FabricHeader> added;
  for (std::size_t i = readers_.size(); i < fabrics_.size(); ++i)
    added.push_back(header_without_layers(fabrics_[i]));
  std::vector<const FabricHeader*> headers;
  for (const FabricReader& reader : readers_) headers.push_back(&reader.header());
  for (const FabricHeader& header : added) headers.push_back(&header);
  std::vector<LackingLevels> lacking;
  const std::vector<LevelRange> asked =
      levels_asked(dressed_, camera_, rows, options_.levels, headers, &lacking);
  warnings_.clear();
  for (std::size_t i = 0; i < lacking.size(); ++i) {
    if (state.levels.forced >= 0) {
      if (auto issue = lacking_issue(fabric_names_[i], *headers[i], state.levels.forced))
        warnings_.push_back(std::move(*issue));
    } else if (lacking[i].any()) {
      warnings_.push_back(lacking_issue(fabric_names_[i], *headers[i], lacking[i]));
    }
  }
  bool more = false;
  for (std::size_t i = 0; i < readers_.size(); ++i) {
    const int before = readers_[i].header().first_level();
    const int last = readers_[i].header().levels - 1;
    const int there = fabrics_[i].first_level() - before;
    const bool worn =
        std::find(state.fabrics.begin(), state.fabrics.end(), static_cast<int>(i)) != state.fabrics.end();
    int first = asked[i].first;
    if (state.levels.forced >= 0)
      first = std::clamp(state.levels.forced - before, 0, last);
    else if (options_.path == RenderPath::paper)
      first = finest_for_paper(std::min(first, there));
    if (!worn || first >= there) continue;
    // The renderer points to the fabrics, and its textures take what may be needed for levels.
    renderer_.reset();
    Result<Fabric> finer = read_levels_within(readers_[i], {first, there - 1}, memory_);
    if (!finer) return tl::unexpected(finer.error());
    add_finer(fabrics_[i], *finer, partial_fabric(readers_[i].header(), first, last).whole);
    more = true;
  }
  return more ? load(state) : Result<void>();
}

Result<void> ShowPicture::draw(const ShowState& state) {
  const Clock::time_point start = Clock::now();
  const double aspect = static_cast<double>(options_.width) / options_.height;
  const Result<Camera> camera = make_camera(corners_, aspect, state.camera);
  if (!camera) return tl::unexpected(camera.error());
  camera_ = *camera;
  options_.levels = state.levels;
  // Loading resets the lights.
  if (auto good = read_levels(state, options_.height); !good) return good;
  set_light(state);
  options_.lights = lights_in_world(state, camera_);
  if (auto good = renderer_->draw(camera_, options_, frame_, stats_); !good) return good;
  draw_seconds_ = seconds_since(start);
  refined_ = 0;
  overlay_.clear();
  overlay_seconds_ = 0;
  if (state.overlay == 0 || options_.ends()) return {};
  const Clock::time_point overlay_start = Clock::now();
  auto good = renderer_->overlay(static_cast<Overlay>(state.overlay), camera_, options_, overlay_);
  overlay_seconds_ = seconds_since(overlay_start);
  return good;
}

Result<void> ShowPicture::update(const ShowState& state, Change change, const V2i& size, int divisor,
                                 const std::atomic<bool>* interrupted) {
  if (change == Change::none) return {};
  options_.interrupted = interrupted;
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
  if (options_.ends()) return {};
  const Clock::time_point start = Clock::now();
  to_display_bytes(frame_, state.display, bytes_);
  display_seconds_ = seconds_since(start);
  return {};
}

Result<bool> ShowPicture::refine(const ShowState& state, const std::atomic<bool>* interrupted) {
  constexpr int n = samples_at_rest;
  options_.interrupted = interrupted;
  if (!renderer_ || options_.path != RenderPath::hybrid || refined_ == n * n) return false;
  // Samples are smaller than pixels, and may need finer levels.
  if (refined_ == 0) {
    if (auto good = read_levels(state, n * options_.height); !good) return tl::unexpected(good.error());
    options_.lights = lights_in_world(state, camera_);
  }
  RenderOptions options = options_;
  options.levels.footprint = 1.0F / n;
  Camera camera = camera_;
  const int row = refined_ / n;
  const V2d place((refined_ % n + 0.5) / n - 0.5, (row + 0.5) / n - 0.5);
  camera.window_centre += place * camera.window_half * 2.0 / V2d(frame_.width, frame_.height);
  RenderStats unwanted;
  if (auto good = renderer_->draw(camera, options, sample_, unwanted); !good)
    return tl::unexpected(good.error());
  if (options_.ends()) return false;
  if (refined_ == 0) {
    first_ = frame_;
    samples_.pixels.assign(frame_.pixels.size(), V4f(0, 0, 0, 0));
  }
  ++refined_;
  for (std::size_t i = 0; i < frame_.pixels.size(); ++i) {
    samples_.pixels[i] += sample_.pixels[i];
    frame_.pixels[i] = (samples_.pixels[i] + first_.pixels[i] * static_cast<float>(n * n - refined_)) /
                       static_cast<float>(n * n);
  }
  to_display_bytes(frame_, state.display, bytes_);
  return true;
}

Result<std::optional<PixelProbe>> ShowPicture::probe(const V2d& point) {
  if (!renderer_ || !(point.x >= 0 && point.x < 1 && point.y >= 0 && point.y < 1)) return std::nullopt;
  const V2i pixel(static_cast<int>(point.x * frame_.width), static_cast<int>(point.y * frame_.height));
  return renderer_->probe(camera_, options_, pixel);
}

}  // namespace selvedge
