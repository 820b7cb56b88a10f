#include "viewer/accuracy.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <map>
#include <mutex>
#include <numbers>
#include <thread>
#include <utility>

#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/base/srgb.h"
#include "format/picture/display.h"
#include "viewer/scene/material.h"

namespace selvedge {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int max_supersample = 8;
/// dB that twice the rays along a pixel's side give, about (tests/bench/accuracy.mjs).
constexpr double gain_of_twice = 6.5;

V3f display_value(const V4f& pixel) {
  static const DisplayOptions display = default_display();
  const V3f c = V3f(pixel.x, pixel.y, pixel.z) * display.exposure + *display.background * (1 - pixel.w);
  const auto encoded = [](float x) { return linear_to_srgb(std::clamp(x, 0.0F, 1.0F)); };
  return {encoded(c.x), encoded(c.y), encoded(c.z)};
}

double decibels(double mean_square) { return -10 * std::log10(std::max(mean_square, 1e-20)); }

/// Picture of one ray a pixel: takes 0.7 to 1.1 times as long as 2 x 2 rays, and has to have so many dB more
/// than asked for; it is tried where 2 x 2 rays have so many above that.
constexpr double for_one = 4;
constexpr double gain_of_two = 5;

/// Draws a view with any supersampling.
class Drawer {
 public:
  Drawer(Renderer& renderer, const FrameSize& size, const Camera& camera, const DrawOptions& options,
         RenderStats& stats)
      : renderer_(renderer), size_(size), camera_(camera), options_(options), stats_(stats) {}

  /// Only pixels of `blocks`, if there are any. Returns whether nothing interrupted it. Throws a Failure.
  bool draw(int supersample, const FrameBlocks* blocks, Frame& frame) {
    size_.supersample = supersample;
    value_or_throw(renderer_.resize(size_));
    options_.blocks = blocks;
    options_.cells.samples = samples_of(supersample);
    RenderStats stats;
    value_or_throw(renderer_.draw(camera_, options_, frame, stats));
    const bool is_complete = stats.rows == size_.height;
    if (is_complete && blocks == nullptr) std::swap(stats_, stats);
    for (const auto& [name, seconds] : render_seconds)
      if (seconds != &RenderStats::prepare) stats_.*seconds += stats.*seconds;
    return is_complete;
  }
  /// Largest supersampling that the index pass can draw.
  int limit() const {
    return std::min(max_supersample, index_pass_side_limit / std::max(size_.width, size_.height));
  }
  const RenderStats& stats() const { return stats_; }
  void set_interrupted(const std::atomic<bool>* interrupted) { options_.interrupted = interrupted; }

 private:
  Renderer& renderer_;
  FrameSize size_;
  const Camera& camera_;
  DrawOptions options_;
  RenderStats& stats_;
};

/// Blocks of a picture, spread evenly over it, drawn with several supersamplings: as many as it takes until
/// the standard error of an estimate is small.
class Probe {
 public:
  Probe(Drawer& drawer, const FrameSize& size) : drawer_(drawer), size_(size) {
    blocks_.across = (size.width + blocks_.side - 1) / blocks_.side;
    blocks_.drawn.resize(static_cast<std::size_t>(blocks_.across) *
                         ((size.height + blocks_.side - 1) / blocks_.side));
    taken_ = blocks_.drawn;
  }

  /// The picture with some supersampling is drawn.
  void know(int supersample, const Frame& frame) {
    drawn_[supersample] = {frame, std::vector<std::uint8_t>(taken_.size(), 1)};
  }

  /// dB of the picture with some supersampling beside that with another; 0 if it was interrupted. Less
  /// exact where it is clearly below or above these.
  double accuracy(int supersample, int beside, double below = 0, double above = HUGE_VAL) {
    constexpr std::size_t min_blocks = 24;
    constexpr std::size_t max_blocks = 96;
    constexpr double max_error = 0.25;  // of the mean square
    constexpr double clear = 1.5;       // standard errors
    if (count_ == 0) take(min_blocks);
    for (std::size_t shown = 0;; take(shown < min_blocks / 2 ? 7 * count_ : count_)) {
      double sum = 0;
      double squares = 0;
      shown = 0;  // blocks with something in them: others cost nothing, and tell little
      for (const double square : block_errors(supersample, beside)) {
        sum += square;
        squares += square * square;
        shown += square > 0 ? 1 : 0;
      }
      const double error =
          std::sqrt(std::max(squares / (sum * sum) - 1.0 / static_cast<double>(count_), 0.0));
      const double result = decibels(sum / static_cast<double>(pixels_));
      const double reach = decibels(1 / (1 + clear * error));
      const bool is_clear = result + reach < below || result - reach > above;
      const bool is_near = std::min(std::abs(result - below), std::abs(result - above)) < reach;
      const bool is_exact = error < max_error && (!is_near || shown > min_blocks);
      if ((shown >= min_blocks && (is_exact || is_clear)) || shown >= max_blocks || count_ == taken_.size() ||
          is_late_)
        return is_late_ ? 0 : result;
    }
  }

 private:
  struct Drawn {
    Frame frame;
    std::vector<std::uint8_t> blocks;
  };

  /// Calls body(pixel, block) for the pixels of blocks.
  template <class Body>
  void for_each_pixel(const std::vector<std::uint8_t>& blocks, const Body& body) const {
    for (int y = 0; y < size_.height; ++y) {
      const std::size_t row =
          static_cast<std::size_t>((size_.height - 1 - y) / blocks_.side) * blocks_.across;
      for (int x = 0; x < size_.width; ++x)
        if (const std::size_t block = row + x / blocks_.side; blocks[block] != 0)
          body(static_cast<std::size_t>(y) * size_.width + x, block);
    }
  }

  /// Takes more blocks, as many as there are, by multiples of the golden ratio.
  void take(std::size_t more) {
    for (; more > 0 && count_ < taken_.size(); ++next_) {
      const double place = next_ * std::numbers::phi;
      std::uint8_t& block =
          taken_[static_cast<std::size_t>((place - std::floor(place)) * static_cast<double>(taken_.size()))];
      if (std::exchange(block, 1) != 0) continue;
      ++count_;
      --more;
    }
  }

  /// Squares of the differences of the blocks that are taken, and how many there are.
  std::vector<double> block_errors(int supersample, int beside) {
    const Frame& a = drawn(supersample);
    const Frame& b = drawn(beside);
    std::vector<double> squares(taken_.size());
    pixels_ = 0;
    for_each_pixel(taken_, [&](std::size_t i, std::size_t block) {
      squares[block] += (display_value(a.pixels[i]) - display_value(b.pixels[i])).length2();
      pixels_ += 3;
    });
    return squares;
  }

  /// The picture at the blocks that are taken.
  const Frame& drawn(int supersample) {
    Frame& frame = drawn_[supersample].frame;
    std::vector<std::uint8_t>& blocks = drawn_[supersample].blocks;
    blocks.resize(taken_.size());
    for (std::size_t i = 0; i < taken_.size(); ++i)
      blocks_.drawn[i] = taken_[i] != 0 && blocks[i] == 0 ? 1 : 0;
    if (std::ranges::find(blocks_.drawn, 1) == blocks_.drawn.end()) return frame;
    Frame more;
    is_late_ = !drawer_.draw(supersample, &blocks_, more) || is_late_;
    if (frame.pixels.empty()) frame = more;
    for_each_pixel(blocks_.drawn, [&](std::size_t i, std::size_t) { frame.pixels[i] = more.pixels[i]; });
    blocks = taken_;
    return frame;
  }

  Drawer& drawer_;
  FrameSize size_;
  FrameBlocks blocks_;
  std::vector<std::uint8_t> taken_;
  std::size_t count_ = 0;  ///< of taken_
  bool is_late_ = false;   ///< a drawing was interrupted
  int next_ = 1;
  std::map<int, Drawn> drawn_;
  std::size_t pixels_ = 0;  ///< of taken_, channels counted
};

/// Draws with the least supersampling that has an accuracy, dB.
AccuratePicture draw_accurate(Drawer& drawer, double wanted, const FrameSize& size, Frame& frame) {
  AccuratePicture picture{std::min(2, drawer.limit()), 0};
  if (drawer.limit() >= 4) {
    Probe probe(drawer, size);
    const auto is_enough = [&](int supersample, double decibels) {
      picture = {supersample, decibels};
      return picture.accuracy >= wanted;
    };
    double of_two = probe.accuracy(2, 4, wanted, wanted);
    const double of_one =
        of_two > wanted + for_one + gain_of_two ? probe.accuracy(1, 4, wanted + for_one) : 0;
    if (of_one >= wanted + for_one) {
      picture = {1, of_one};
    } else if (of_two = probe.accuracy(2, 4, wanted); !is_enough(2, of_two)) {
      double of_four = of_two + gain_of_twice;
      if (drawer.limit() >= 8) {
        of_four = probe.accuracy(4, 8);
        of_two = probe.accuracy(2, 8);
      }
      // In between, accuracy goes with the logarithm of the rays.
      for (const int supersample : {3, 4, 6, max_supersample})
        if (supersample > drawer.limit() ||
            is_enough(supersample, of_four + (of_four - of_two) * std::log2(supersample / 4.0)))
          break;
    }
  }
  drawer.draw(picture.supersample, nullptr, frame);
  return picture;
}

/// Draws with one ray a pixel, with 2 x 2, then with as many as the time allows.
AccuratePicture draw_in_time(Drawer& drawer, double seconds, const FrameSize& size, Frame& frame) {
  // A late picture is lost. Times go with about this power of the rays along a side; one ray alone tells
  // little.
  constexpr double power = 1.35;
  constexpr double reserve = 1.3;
  constexpr double of_probe = 0.4;  // of the picture's time
  const Clock::time_point begin = Clock::now();
  const auto now = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  drawer.draw(1, nullptr, frame);
  int supersample = 1;
  std::atomic<bool> is_late = false;
  const std::jthread timer([&](const std::stop_token& stop) {
    std::mutex mutex;
    std::unique_lock lock(mutex);
    const auto end =
        begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    std::condition_variable_any().wait_until(lock, stop, end, [] { return false; });
    is_late = true;
  });
  drawer.set_interrupted(&is_late);
  // Shadows of the sky are found once.
  double taken = now() - drawer.stats().shadows;
  for (int next = 2; next > supersample; --next) {
    const double expected = reserve * taken * std::pow(1.0 * next / supersample, power);
    if (next > drawer.limit() || expected > seconds - now()) continue;
    const double before = now();
    Frame finer;
    if (!drawer.draw(next, nullptr, finer)) break;
    taken = now() - before;
    supersample = next;
    frame = std::move(finer);
    next = max_supersample + 1;
  }
  if (2 * supersample > drawer.limit() || of_probe * taken > seconds - now()) return {supersample, 0};
  Probe probe(drawer, size);
  probe.know(supersample, frame);
  return {supersample, probe.accuracy(supersample, 2 * supersample)};
}

}  // namespace

double decibels_between(const Frame& a, const Frame& b) {
  double square = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    square += (display_value(a.pixels[i]) - display_value(b.pixels[i])).length2();
  return decibels(square / (3.0 * static_cast<double>(a.pixels.size())));
}

Result<AccuratePicture> draw_for(Renderer& renderer, const PictureGoal& goal, const FrameSize& size,
                                 const Camera& camera, DrawOptions options, Frame& frame,
                                 RenderStats& stats) {
  return result_of([&] {
    stats = {};
    Drawer drawer(renderer, size, camera, options, stats);
    if (!goal.accuracy && !goal.seconds) {
      drawer.draw(size.supersample, nullptr, frame);
      return AccuratePicture{size.supersample, 0};
    }
    const AccuratePicture picture = goal.accuracy ? draw_accurate(drawer, *goal.accuracy, size, frame)
                                                  : draw_in_time(drawer, *goal.seconds, size, frame);
    FrameSize left = size;
    left.supersample = picture.supersample;
    value_or_throw(renderer.resize(left));
    return picture;
  });
}

}  // namespace selvedge
