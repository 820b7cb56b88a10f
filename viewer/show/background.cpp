#include "viewer/show/background.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "format/base/guard.h"

namespace selvedge {
namespace {

/// How long a wish has to stay before its picture is drawn in full, as the mouse may still move.
constexpr std::chrono::milliseconds still_after{100};

ShownPicture shown(const ShowPicture& picture, int divisor, std::int64_t frames) {
  ShownPicture result;
  result.width = picture.frame().width;
  result.height = picture.frame().height;
  result.divisor = divisor;
  result.bytes = picture.bytes();
  result.camera = picture.camera();
  result.lights = picture.lights();
  result.stats = picture.stats();
  result.draw_seconds = picture.draw_seconds();
  result.display_seconds = picture.display_seconds();
  result.frames = frames;
  for (const SceneMaterial& material : picture.scene().materials)
    result.materials.push_back(!material.fabric ? "" : material.name.empty() ? "material" : material.name);
  for (const SceneFabric& fabric : picture.scene().fabrics) result.fabric_names.push_back(fabric.name);
  for (const Fabric& fabric : picture.fabrics())
    result.levels = std::max(result.levels, static_cast<int>(fabric.levels.size()));
  result.size = picture.size();
  result.own_lights = lights_of(picture.scene());
  return result;
}

}  // namespace

BackgroundPicture::BackgroundPicture(std::unique_ptr<ShowPicture> picture, std::string garment,
                                     std::string name, const SceneLimits& limits, Tailor tailor,
                                     std::function<void()> wake)
    : picture_(std::move(picture)),
      garment_(std::move(garment)),
      name_(std::move(name)),
      limits_(limits),
      tailor_(std::move(tailor)),
      wake_(std::move(wake)),
      thread_([this] { run(); }) {}

BackgroundPicture::~BackgroundPicture() {
  {
    const std::lock_guard lock(mutex_);
    closes_ = true;
    interrupted_ = true;
    asked_ = true;
  }
  there_is_work_.notify_one();
  thread_.join();
}

std::uint64_t BackgroundPicture::set_wish(PictureWish wish) {
  std::uint64_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    if (next_) wish.change = std::max(wish.change, next_->change);
    if (wish.change != Change::none) interrupted_ = true;
    asked_ = true;
    next_ = std::move(wish);
    news_.finished = false;
    number = ++wishes_;
  }
  there_is_work_.notify_one();
  return number;
}

void BackgroundPicture::ask(const std::string& path,
                            Result<std::string> (BackgroundPicture::*action)(const std::string&),
                            Tasks& tasks) {
  {
    const std::lock_guard lock(mutex_);
    tasks.push_back({path, action});
    if (&tasks == &urgent_) interrupted_ = asked_ = true;
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
  rest.probe_wish = news_.probe_wish;
  return std::exchange(news_, std::move(rest));
}

/// Changes the news under the mutex, then wakes the window.
void BackgroundPicture::tell(const std::function<void(PictureNews&)>& change) {
  {
    const std::lock_guard lock(mutex_);
    change(news_);
    news_.finished = !next_ && urgent_.empty() && soon_.empty() && at_rest_.empty() &&
                     (stage_ == Stage::samples || stage_ == Stage::rest) && !probes_;
  }
  wake_();
}

void BackgroundPicture::tell_message(const std::string& message) {
  tell([&](PictureNews& news) { news.messages.push_back(message); });
}

void BackgroundPicture::run() {
  for (;;) {
    Tasks tasks;
    {
      std::unique_lock lock(mutex_);
      const auto is_asked = [&] { return closes_ || next_ || !urgent_.empty(); };
      if (stage_ == Stage::full) there_is_work_.wait_for(lock, still_after, is_asked);
      there_is_work_.wait(lock, [&] {
        return is_asked() || stage_ != Stage::rest || probes_ || !soon_.empty() || !at_rest_.empty();
      });
      if (closes_) break;
      tasks.swap(urgent_);
      interrupted_ = false;
      asked_ = false;
      if (next_) {
        number_ = wishes_;
        take(*std::exchange(next_, std::nullopt));
      }
      const bool drawn = (stage_ == Stage::samples || stage_ == Stage::rest) && !probes_ && tasks.empty();
      Tasks& patient = stage_ == Stage::rest && !at_rest_.empty() ? at_rest_ : soon_;
      if (drawn && !patient.empty()) {
        tasks.push_back(std::move(patient.front()));
        patient.pop_front();
      }
    }
    for (const Task& task : tasks) perform(task);
    if (const auto good = guarded("", [&] { return step(); }); !good) {
      tell([&](PictureNews& news) { news.failure = good.error(); });
      break;
    }
  }
  // Objects of OpenGL are deleted by the thread that made them.
  picture_.reset();
}

void BackgroundPicture::perform(const Task& task) {
  const Result<std::string> said = guarded(task.path, [&] { return (this->*task.action)(task.path); });
  tell([&](PictureNews& news) {
    // Of the fabrics of a folder, only the faults are worth a line.
    if (!said || task.action != &BackgroundPicture::offer)
      news.messages.push_back(said ? *said : to_line(said.error()));
  });
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
  if (stage_ == Stage::first) return draw_first();
  if (stage_ == Stage::full) {
    draw_in_full();
  } else if (probes_) {
    probes_ = false;
    probe();
  } else if (stage_ == Stage::samples) {
    add_samples();
  }
  return {};
}

/// The first picture of the wish, which is small where a large one takes long.
Result<void> BackgroundPicture::draw_first() {
  const int divisor =
      change_ == Change::display ? divisor_ : size_divisor(full_seconds_, first_picture_seconds);
  if (auto good = picture_->update(wish_.state, change_, wish_.size, divisor, &closes_); !good) {
    if (!good_) return good;
    // Back to the last good state, as not every path draws everything.
    wish_.state = *good_;
    ++era_;
    tell([&](PictureNews& news) {
      news.messages.push_back(to_line(good.error()));
      news.state = *good_;
      news.era = era_;
    });
    change_ = Change::scene;
    if (auto again = picture_->update(wish_.state, change_, wish_.size, divisor, &closes_); !again)
      return again;
  }
  good_ = wish_.state;
  divisor_ = divisor;
  if (std::exchange(change_, Change::none) >= Change::frame) {
    ++frames_;
    full_seconds_ = picture_->draw_seconds() * divisor * divisor;
  }
  stage_ = divisor > 1 ? Stage::full : Stage::samples;
  show();
  // The wheel wants to know what is under the mouse; the probe of the full picture follows.
  if (divisor > 1 && wish_.probed) probe();
  return {};
}

void BackgroundPicture::draw_in_full() {
  const auto good = picture_->update(wish_.state, Change::frame, wish_.size, 1, &interrupted_);
  // What was drawn in part is of no use, not even for another display of it.
  if (!good || interrupted_) change_ = std::max(change_, Change::frame);
  if (!good) {
    // The small picture stays.
    stage_ = Stage::rest;
    tell_message(to_line(good.error()));
    return;
  }
  if (interrupted_) {
    stage_ = Stage::first;
    return;
  }
  divisor_ = 1;
  ++frames_;
  full_seconds_ = picture_->draw_seconds();
  stage_ = Stage::samples;
  show();
}

void BackgroundPicture::add_samples() {
  const Result<bool> more = picture_->refine(wish_.state, &asked_);
  if (more && *more) {
    show();
  } else if (!more || !asked_) {
    stage_ = Stage::rest;
    tell([&](PictureNews& news) {
      if (!more) news.messages.push_back(to_line(more.error()));
    });
  }
}

void BackgroundPicture::show(const std::optional<ShownGarment>& garment) {
  auto picture = std::make_shared<const ShownPicture>(shown(*picture_, divisor_, frames_));
  tell([&](PictureNews& news) {
    news.picture = std::move(picture);
    if (!garment) return;
    news.garment = garment;
    news.state.reset();
    news.worn.reset();
    news.era = era_;
    news.probed.reset();
    news.probe.reset();
  });
}

void BackgroundPicture::probe() {
  std::optional<PixelProbe> seen;
  std::string message;
  if (wish_.probed) {
    Result<std::optional<PixelProbe>> found = picture_->probe(*wish_.probed);
    if (found) {
      seen = std::move(*found);
    } else {
      message = to_line(found.error());
    }
  }
  tell([&](PictureNews& news) {
    news.probed = wish_.probed;
    news.probe = std::move(seen);
    news.probe_wish = number_;
    if (!message.empty()) news.messages.push_back(message);
  });
}

}  // namespace selvedge
