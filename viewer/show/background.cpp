#include "viewer/show/background.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "format/base/option_text.h"
#include "format/picture/environment.h"

namespace selvedge {
namespace {

/// Seconds above which a picture is drawn smaller first.
constexpr double first_budget = 0.05;
/// How long a wish has to stay before its picture is drawn in full, as the mouse may still move.
constexpr std::chrono::milliseconds still_after{100};

ShownPicture shown(const ShowPicture& picture, int divisor, std::int64_t frames) {
  ShownPicture result;
  result.width = picture.frame().width;
  result.height = picture.frame().height;
  result.divisor = divisor;
  result.bytes = picture.bytes();
  result.overlay = picture.overlay();
  result.camera = picture.camera();
  result.lights = picture.lights();
  result.stats = picture.stats();
  result.draw_seconds = picture.draw_seconds();
  result.overlay_seconds = picture.overlay_seconds();
  result.display_seconds = picture.display_seconds();
  result.frames = frames;
  result.warnings = picture.warnings();
  for (const SceneMaterial& material : picture.scene().materials)
    result.materials.push_back(!material.fabric ? "" : material.name.empty() ? "material" : material.name);
  result.fabric_names = picture.fabric_names();
  for (const Fabric& fabric : picture.fabrics())
    result.levels = std::max(result.levels, fabric.first_level() + static_cast<int>(fabric.levels.size()));
  result.bytes_read = picture.bytes_read();
  result.file_bytes = picture.file_bytes();
  result.size = picture.size();
  return result;
}

}  // namespace

BackgroundPicture::BackgroundPicture(std::unique_ptr<ShowPicture> picture, const SceneLimits& limits,
                                     std::function<void()> wake)
    : picture_(std::move(picture)), limits_(limits), wake_(std::move(wake)), thread_([this] { run(); }) {}

BackgroundPicture::~BackgroundPicture() {
  {
    const std::lock_guard lock(mutex_);
    closes_ = true;
    interrupted_ = true;
  }
  there_is_work_.notify_one();
  thread_.join();
}

void BackgroundPicture::set_wish(PictureWish wish) {
  {
    const std::lock_guard lock(mutex_);
    if (next_) wish.change = std::max(wish.change, next_->change);
    if (wish.change != Change::none) interrupted_ = true;
    next_ = std::move(wish);
    news_.finished = false;
  }
  there_is_work_.notify_one();
}

void BackgroundPicture::add_file(const std::string& path) {
  {
    const std::lock_guard lock(mutex_);
    files_.push_back(path);
    interrupted_ = true;
    news_.finished = false;
  }
  there_is_work_.notify_one();
}

PictureNews BackgroundPicture::poll() {
  const std::lock_guard lock(mutex_);
  PictureNews rest;
  rest.finished = news_.finished;
  rest.era = news_.era;
  rest.probed = news_.probed;
  rest.probe = news_.probe;
  return std::exchange(news_, std::move(rest));
}

/// Changes the news under the mutex, then wakes the window.
template <class Change>
void BackgroundPicture::tell(Change change) {
  {
    const std::lock_guard lock(mutex_);
    change(news_);
    news_.finished =
        !next_ && files_.empty() && (stage_ == Stage::samples || stage_ == Stage::rest) && !probes_;
  }
  wake_();
}

void BackgroundPicture::run() {
  for (;;) {
    std::vector<std::string> files;
    {
      std::unique_lock lock(mutex_);
      const auto is_asked = [&] { return closes_ || next_ || !files_.empty(); };
      if (stage_ == Stage::full) there_is_work_.wait_for(lock, still_after, is_asked);
      there_is_work_.wait(lock, [&] { return is_asked() || stage_ != Stage::rest || probes_; });
      if (closes_) break;
      files.swap(files_);
      interrupted_ = false;
      if (next_) take(*std::exchange(next_, std::nullopt));
    }
    for (const std::string& file : files) add(file);
    if (const auto good = step(); !good) {
      tell([&](PictureNews& news) { news.failure = good.error(); });
      break;
    }
  }
  // Objects of OpenGL are deleted by the thread that made them.
  picture_.reset();
}

void BackgroundPicture::take(PictureWish wish) {
  if (wish.era != era_) return;
  if (wish.size != wish_.size) wish.change = std::max(wish.change, Change::frame);
  change_ = std::max(change_, wish.change);
  if (change_ != Change::none) stage_ = Stage::first;
  probes_ = true;
  wish_ = std::move(wish);
}

/// One step of the way from the wish to its best picture.
Result<void> BackgroundPicture::step() {
  switch (stage_) {
    case Stage::first: {
      const int divisor = change_ == Change::display ? divisor_ : size_divisor(full_seconds_, first_budget);
      if (auto good = draw(change_, divisor, nullptr); !good) return good;
      stage_ = divisor > 1 ? Stage::full : Stage::samples;
      show();
      return {};
    }
    case Stage::full:
      if (auto good = draw(Change::frame, 1, &interrupted_); !good) return good;
      // What was drawn is of no use, not even for another display of it.
      if (interrupted_) {
        change_ = std::max(change_, Change::frame);
        stage_ = Stage::first;
        return {};
      }
      stage_ = Stage::samples;
      show();
      return {};
    case Stage::samples: {
      if (probes_) return probe();
      const Result<bool> more = picture_->refine(wish_.state, &interrupted_);
      if (!more) return tl::unexpected(more.error());
      if (*more) {
        show();
      } else if (!interrupted_) {
        stage_ = Stage::rest;
      }
      return {};
    }
    case Stage::rest:
      return probes_ ? probe() : Result<void>();
  }
  return {};
}

Result<void> BackgroundPicture::draw(Change change, int divisor, const std::atomic<bool>* interrupted) {
  if (auto good = picture_->update(wish_.state, change, wish_.size, divisor, interrupted); !good) {
    if (!good_) return good;
    // Back to the last good state, as not every path draws everything.
    wish_.state = *good_;
    ++era_;
    tell([&](PictureNews& news) {
      news.message = to_line(good.error());
      news.state = *good_;
      news.era = era_;
    });
    if (auto again = picture_->update(wish_.state, Change::scene, wish_.size, divisor); !again) return again;
  }
  if (interrupted != nullptr && *interrupted) return {};
  good_ = wish_.state;
  divisor_ = divisor;
  change_ = Change::none;
  if (change < Change::frame) return {};
  ++frames_;
  full_seconds_ = (picture_->draw_seconds() + picture_->overlay_seconds()) * divisor * divisor;
  return {};
}

void BackgroundPicture::show() {
  auto picture = std::make_shared<const ShownPicture>(shown(*picture_, divisor_, frames_));
  tell([&](PictureNews& news) { news.picture = std::move(picture); });
}

Result<void> BackgroundPicture::probe() {
  std::optional<PixelProbe> seen;
  if (wish_.probed) {
    Result<std::optional<PixelProbe>> found = picture_->probe(*wish_.probed);
    if (!found) return tl::unexpected(found.error());
    seen = std::move(*found);
  }
  probes_ = false;
  tell([&](PictureNews& news) {
    news.probed = wish_.probed;
    news.probe = std::move(seen);
  });
  return {};
}

/// A fabric to choose from, an environment, or another garment.
void BackgroundPicture::add(const std::string& path) {
  std::string message;
  std::shared_ptr<const Surroundings> environment;
  if (has_ending(path, ".glb") || has_ending(path, ".gltf")) {
    if (const auto good = show_garment(path); !good) message = to_line(good.error());
  } else if (const auto fabric = picture_->add_fabric(path)) {
    change_ = Change::scene;
    stage_ = Stage::first;
  } else if (const auto read = read_environment(path)) {
    environment = std::make_shared<const Surroundings>(Surroundings{path, *read, divide(*read)});
  } else {
    message = to_line(has_ending(path, ".exr") ? fabric.error() : read.error());
  }
  tell([&](PictureNews& news) {
    news.message = message;
    if (environment) news.environment = environment;
  });
}

Result<void> BackgroundPicture::show_garment(const std::string& path) {
  Result<OpenScene> scene = open_scene(path, {}, limits_);
  if (!scene) return tl::unexpected(scene.error());
  auto picture = ShowPicture::create(std::move(*scene));
  if (!picture) return tl::unexpected(picture.error());
  const double aspect = static_cast<double>(wish_.size.x) / wish_.size.y;
  const Result<ShowState> first = (*picture)->first_state({}, aspect);
  if (!first) return tl::unexpected(first.error());
  picture_ = std::move(*picture);
  wish_.state.camera = first->camera;
  wish_.state.fabrics = first->fabrics;
  wish_.state.fits = first->fits;
  change_ = Change::scene;
  stage_ = Stage::first;
  full_seconds_ = 1e9;
  good_.reset();
  ++era_;
  tell([&](PictureNews& news) {
    news.state = wish_.state;
    news.era = era_;
  });
  return {};
}

}  // namespace selvedge
