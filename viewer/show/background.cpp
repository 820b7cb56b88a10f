#include "viewer/show/background.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <utility>

#include "format/base/guard.h"
#include "format/base/option_text.h"
#include "format/fabric/file.h"
#include "format/picture/display.h"
#include "format/picture/environment.h"
#include "format/picture/image.h"
#include "format/scene/swatch.h"
#include "viewer/load.h"
#include "viewer/scene/change_fabrics.h"

namespace selvedge {
namespace {

/// How long a request has to stay before its picture is drawn in full, as the mouse may still move.
constexpr std::chrono::milliseconds still_after{100};

ShownPicture shown(const ShowPicture& picture, double divisor, std::int64_t frames) {
  ShownPicture result;
  static_cast<DrawnPicture&>(result) = picture.drawn();
  result.size_divisor = divisor;
  result.frame_count = frames;
  for (const SceneMaterial& material : picture.scene().materials)
    result.materials.push_back(!material.fabric ? "" : material.name.empty() ? "material" : material.name);
  for (const SceneFabric& fabric : picture.scene().fabrics) result.fabric_names.push_back(fabric.name);
  for (const Fabric& fabric : picture.fabrics())
    result.levels = std::max(result.levels, static_cast<int>(fabric.levels.size()));
  result.own_lights = scene_lights(picture.scene());
  return result;
}

std::string free_file(const std::string& stem, const char* ending) {
  std::string path;
  std::error_code unknown;
  for (int i = 1; path.empty() || std::filesystem::exists(path, unknown); ++i)
    path = stem + "-" + std::to_string(i) + ending;
  return path;
}

}  // namespace

PictureThread::PictureThread(std::unique_ptr<ShowPicture> picture, std::string garment, std::string name,
                             const SceneLimits& limits, GarmentWriter writer, std::function<void()> wake)
    : picture_(std::move(picture)),
      garment_(std::move(garment)),
      name_(std::move(name)),
      limits_(limits),
      garment_writer_(std::move(writer)),
      wake_(std::move(wake)),
      thread_([this] { run(); }) {}

PictureThread::~PictureThread() {
  {
    const std::lock_guard lock(mutex_);
    closes_ = interrupted_ = asked_ = true;
  }
  there_is_work_.notify_one();
  thread_.join();
}

std::uint64_t PictureThread::request(RenderRequest request) {
  const std::lock_guard lock(mutex_);
  if (next_) request.redraw = std::max(request.redraw, next_->redraw);
  if (request.redraw != Redraw::none) interrupted_ = true;
  asked_ = true;
  next_ = std::move(request);
  update_.is_finished = false;
  there_is_work_.notify_one();
  return ++requests_;
}

void PictureThread::queue(const std::string& path, Action action, When when) {
  const std::lock_guard lock(mutex_);
  tasks_.push_back({when, path, action});
  if (when == When::at_once) interrupted_ = asked_ = true;
  update_.is_finished = false;
  there_is_work_.notify_one();
}

/// The tasks whose time has come, under the mutex: all that are for at once, or one of the others.
std::vector<PictureThread::Task> PictureThread::take_tasks() {
  const auto take = [&](When when, std::size_t most) {
    std::vector<Task> taken;
    for (auto task = tasks_.begin(); task != tasks_.end() && taken.size() < most;) {
      if (task->when != when) {
        ++task;
        continue;
      }
      taken.push_back(std::move(*task));
      task = tasks_.erase(task);
    }
    return taken;
  };
  std::vector<Task> tasks = take(When::at_once, tasks_.size());
  if (!tasks.empty() || probes_ || stage_ < Stage::samples) return tasks;
  if (stage_ == Stage::rest) tasks = take(When::at_rest, 1);
  return tasks.empty() ? take(When::between_samples, 1) : tasks;
}

RenderUpdate PictureThread::poll() {
  const std::lock_guard lock(mutex_);
  RenderUpdate rest;
  rest.is_finished = update_.is_finished;
  rest.generation = update_.generation;
  rest.probed_point = update_.probed_point;
  rest.probe = update_.probe;
  rest.probe_request = update_.probe_request;
  return std::exchange(update_, std::move(rest));
}

/// Changes the update under the mutex, then wakes the window.
void PictureThread::post(const std::function<void(RenderUpdate&)>& change) {
  {
    const std::lock_guard lock(mutex_);
    change(update_);
    update_.is_finished = !next_ && tasks_.empty() && stage_ >= Stage::samples && !probes_;
  }
  wake_();
}

void PictureThread::run() {
  for (;;) {
    std::vector<Task> tasks;
    {
      std::unique_lock lock(mutex_);
      const auto is_asked = [&] {
        return closes_ || next_ || std::ranges::find(tasks_, When::at_once, &Task::when) != tasks_.end();
      };
      if (stage_ == Stage::full) there_is_work_.wait_for(lock, still_after, is_asked);
      there_is_work_.wait(lock,
                          [&] { return is_asked() || stage_ != Stage::rest || probes_ || !tasks_.empty(); });
      if (closes_) break;
      interrupted_ = false;
      asked_ = false;
      if (next_) {
        number_ = requests_;
        RenderRequest request = *std::exchange(next_, std::nullopt);
        if (request.generation == generation_) {
          if (request.size != request_.size) request.redraw = std::max(request.redraw, Redraw::frame);
          change_ = std::max(change_, request.redraw);
          if (change_ != Redraw::none) stage_ = Stage::first;
          probes_ = true;
          request_ = std::move(request);
        }
      }
      tasks = take_tasks();
    }
    for (const Task& task : tasks) perform(task);
    try {
      // One step of the way from the request to its best picture.
      if (stage_ == Stage::first)
        draw_first();
      else if (stage_ == Stage::full)
        draw_in_full();
      else if (std::exchange(probes_, false))
        probe();
      else if (stage_ == Stage::samples)
        add_samples();
    } catch (...) {
      post([&](RenderUpdate& update) { update.failure = thrown_error(""); });
      break;
    }
  }
  // Objects of OpenGL are deleted by the thread that made them.
  picture_.reset();
}

void PictureThread::perform(const Task& task) {
  const auto said =
      catch_exceptions(task.path, [&]() -> Result<std::string> { return (this->*task.action)(task.path); });
  post([&](RenderUpdate& update) {
    // Only the faults of the fabrics of a folder are worth a line.
    if (!said || task.action != &PictureThread::offer)
      update.messages.push_back(said ? *said : to_line(said.error()));
  });
}

/// The first picture of the request, which is small where a large one takes long.
void PictureThread::draw_first() {
  const double divisor = change_ == Redraw::display ? divisor_ : pace_.size_divisor();
  if (auto good = picture_->update(request_.state, change_, request_.size, divisor, &closes_); !good) {
    if (!good_) throw Failure{good.error()};
    // Back to the last good state, as not every path draws everything.
    request_.state = *good_;
    ++generation_;
    post([&](RenderUpdate& update) {
      update.messages.push_back(to_line(good.error()));
      update.state = *good_;
      update.generation = generation_;
    });
    change_ = Redraw::scene;
    value_or_throw(picture_->update(request_.state, change_, request_.size, divisor, &closes_));
  }
  good_ = request_.state;
  divisor_ = divisor;
  if (std::exchange(change_, Redraw::none) >= Redraw::frame) {
    ++frames_;
    pace_.add_frame(picture_->drawn().draw_seconds, request_.state.frame_seconds);
  }
  stage_ = divisor > 1 ? Stage::full : Stage::samples;
  show();
  // The wheel wants to know what is under the mouse; the probe of the full picture follows.
  if (divisor > 1 && request_.probed_point) probe();
}

void PictureThread::draw_in_full() {
  const auto good = picture_->update(request_.state, Redraw::frame, request_.size, 1, &interrupted_);
  // A part of a picture is of no use, not even for another display of it.
  if (!good || interrupted_) change_ = std::max(change_, Redraw::frame);
  if (!good) {
    // The small picture stays.
    stage_ = Stage::rest;
    post([&](RenderUpdate& update) { update.messages.push_back(to_line(good.error())); });
    return;
  }
  if (interrupted_) {
    stage_ = Stage::first;
    return;
  }
  divisor_ = 1;
  ++frames_;
  stage_ = Stage::samples;
  show();
}

void PictureThread::add_samples() {
  const Result<bool> more = picture_->refine(request_.state, &asked_);
  if (more && *more) {
    show();
  } else if (!more || !asked_) {
    stage_ = Stage::rest;
    post([&](RenderUpdate& update) {
      if (!more) update.messages.push_back(to_line(more.error()));
    });
  }
}

void PictureThread::show(const std::optional<ShownGarment>& garment) {
  auto picture = std::make_shared<const ShownPicture>(shown(*picture_, divisor_, frames_));
  post([&](RenderUpdate& update) {
    update.picture = std::move(picture);
    if (!garment) return;
    update.garment = garment;
    update.state.reset();
    update.worn_fabrics.reset();
    update.generation = generation_;
    update.probed_point.reset();
    update.probe.reset();
  });
}

void PictureThread::probe() {
  std::optional<PixelProbe> seen;
  std::string message;
  if (request_.probed_point) {
    Result<std::optional<PixelProbe>> found = picture_->probe_surface(*request_.probed_point);
    if (found)
      seen = std::move(*found);
    else
      message = to_line(found.error());
  }
  post([&](RenderUpdate& update) {
    update.probed_point = request_.probed_point;
    update.probe = std::move(seen);
    update.probe_request = number_;
    if (!message.empty()) update.messages.push_back(message);
  });
}

std::string PictureThread::add(const std::string& path) {
  std::error_code unknown;
  if (std::filesystem::is_directory(path, unknown)) {
    // None where it cannot be read.
    std::vector<std::string> fabrics;
    for (std::filesystem::directory_iterator at(path, unknown), end; at != end; at.increment(unknown))
      if (has_ending(at->path().string(), ".exr")) fabrics.push_back(at->path().string());
    std::ranges::sort(fabrics);
    if (fabrics.empty())
      throw Failure{{Code::file_missing, path, {}, "there is no fabric file in this folder"}};
    for (const std::string& fabric : fabrics)
      if (offered_.insert(fabric).second) queue(fabric, &PictureThread::offer, When::between_samples);
  } else if (has_ending(path, ".glb") || has_ending(path, ".gltf")) {
    return show_garment(path, path, false);
  } else if (const auto fabric = FabricReader::open(path)) {
    if (has_no_fabric(picture_->scene())) return put_on(path);
    add_fabric(path);
    change_ = Redraw::scene;
    stage_ = Stage::first;
  } else if (const auto read = read_environment(path, {}, limits_.document.memory)) {
    post([&](RenderUpdate& update) {
      update.environments.push_back(
          std::make_shared<const Surroundings>(Surroundings{path, *read, split_light(*read)}));
    });
    return fmt::format("{}", fmt::join(read->remarks, "\n"));
  } else {
    throw Failure{has_ending(path, ".exr") ? fabric.error() : read.error()};
  }
  return {};
}

void PictureThread::add_fabric(const std::string& path) {
  if (added_.contains(path)) return;
  value_or_throw(picture_->add_fabric(path));
  added_[path] = static_cast<int>(picture_->fabrics().size()) - 1;
}

/// Draws two repeats of a fabric file from near.
std::string PictureThread::offer(const std::string& path) {
  std::vector<Fabric> fabrics(1);
  fabrics[0] = value_or_throw(read_fabric(path, {.memory = limits_.document.memory}));
  const V2d period(fabrics[0].period_mm);
  const SwatchShot shot = swatch_shot(SwatchView::near, period, thumbnail_side, thumbnail_side);
  Scene scene = swatch_scene(period, shot);
  scene.fabrics.emplace_back().name = path;
  RenderOptions options;
  options.width = options.height = thumbnail_side;
  options.supersample = 2;
  options.layers = 1;
  options.lights = shot.lights;
  options.interrupt_flag = &asked_;
  const Frame frame = value_or_throw(render(scene, fabrics, shot.camera, options));
  OfferedFabric offered{path, {}};
  to_display_bytes(frame, default_display(), offered.picture);
  if (asked_)
    queue(path, &PictureThread::offer, When::between_samples);  // the picture comes first
  else
    post([&](RenderUpdate& update) { update.offers.push_back(std::move(offered)); });
  return {};
}

std::string PictureThread::put_on(const std::string& path) {
  if (has_no_fabric(picture_->scene()))
    return show_garment(garment_writer_.dress(garment_, path), name_, true);
  add_fabric(path);
  std::vector<int> worn = fabrics_of(picture_->scene());
  for (int& fabric : worn) fabric = fabric < 0 ? -1 : added_[path];
  request_.state.worn_fabrics.fabrics = worn;
  request_.state.hidden_fabrics.clear();
  change_ = Redraw::scene;
  stage_ = Stage::first;
  ++generation_;
  post([&](RenderUpdate& update) {
    update.worn_fabrics = request_.state.worn_fabrics;
    update.generation = generation_;
  });
  return {};
}

/// The garment before stays until a picture of the other one is there. `name`: of what the user has opened.
std::string PictureThread::show_garment(const std::string& path, const std::string& name, bool keeps_camera) {
  std::optional<Motion> motion;
  LoadedScene scene = value_or_throw(load_first_clip(path, limits_, motion));
  std::string remarks = fmt::format("{}", fmt::join(scene.scene.remarks, "\n"));
  auto picture = value_or_throw(
      ShowPicture::create(std::move(scene.scene), std::move(scene.fabrics), std::move(motion)));
  const double aspect = static_cast<double>(request_.size.x) / request_.size.y;
  const ShowState first = value_or_throw(picture->first_state({}, aspect));
  ShowState state = request_.state;
  if (!keeps_camera) state.camera = first.camera;
  state.worn_fabrics = first.worn_fabrics;
  state.clip = first.clip;
  state.clip_time = 0;
  state.compared_fabrics.reset();
  state.hidden_fabrics.clear();
  pace_ = {};
  const double divisor = pace_.size_divisor();
  value_or_throw(picture->update(state, Redraw::scene, request_.size, divisor, &closes_));
  picture_ = std::move(picture);
  good_ = request_.state = std::move(state);
  divisor_ = divisor;
  change_ = Redraw::none;
  stage_ = Stage::full;
  probes_ = true;
  garment_ = path;
  name_ = name;
  added_.clear();
  ++frames_;
  ++generation_;
  show(ShownGarment{name, keeps_camera ? std::nullopt : std::optional(first.camera), first.worn_fabrics,
                    first.clip});
  return remarks;
}

std::string PictureThread::write_picture(const std::string& stem) {
  const Frame& frame = picture_->frame();
  Image image{frame.width, frame.height, 3, {}};
  image.pixels.reserve(frame.pixels.size() * 3);
  for (std::size_t i = 0; i < picture_->drawn().bytes.size(); ++i)
    if (i % 4 != 3) image.pixels.push_back(static_cast<float>(picture_->drawn().bytes[i]) / 255);
  const std::string path = free_file(stem, ".png");
  value_or_throw(write_png(path, image, Transfer::keep));
  return "saved " + path;
}

std::string PictureThread::write_garment(const std::string& stem) {
  const std::string path = free_file(stem, ".glb");
  const std::string remarks = garment_writer_.save(garment_, picture_->dressed_scene(), path);
  return "saved " + path + (remarks.empty() ? "" : "\n" + remarks);
}

}  // namespace selvedge
