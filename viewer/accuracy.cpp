#include "viewer/accuracy.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/base/srgb.h"
#include "format/picture/display.h"
#include "viewer/scene/material.h"

namespace selvedge {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int max_supersample = 8;
constexpr int picks = 48;

/// dB by which a picture is nearer to one with twice its rays along a pixel's side than to the truth, the
/// median over scenes by a seed (tests/bench/accuracy.mjs).
double nearer(int supersample) { return supersample < 4 ? 0.5 : 0.1; }

/// dB that twice the rays along a pixel's side give, the same.
constexpr double gain_of_twice = 6.5;

V3f display_value(const V4f& pixel) {
  static const DisplayOptions display = default_display();
  const V3f c = V3f(pixel.x, pixel.y, pixel.z) * display.exposure + *display.background * (1 - pixel.w);
  const auto encoded = [](float x) { return linear_to_srgb(std::clamp(x, 0.0F, 1.0F)); };
  return {encoded(c.x), encoded(c.y), encoded(c.z)};
}

double mean_square(const Frame& a, const Frame& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    sum += (display_value(a.pixels[i]) - display_value(b.pixels[i])).length2();
  return sum / (3.0 * static_cast<double>(a.pixels.size()));
}

double decibels(double mean_square) { return -10 * std::log10(std::max(mean_square, 1e-20)); }

/// Draws a view with any supersampling.
class Drawer {
 public:
  Drawer(Renderer& renderer, const FrameSize& size, const Camera& camera, const DrawOptions& options,
         RenderStats& stats)
      : renderer_(renderer), size_(size), camera_(camera), options_(options), stats_(stats) {}

  /// Only pixels of `blocks`, if there are any. Throws a Failure.
  void draw(int supersample, const FrameBlocks* blocks, Frame& frame) {
    size_.supersample = supersample;
    value_or_throw(renderer_.resize(size_));
    options_.blocks = blocks;
    options_.cells.samples = samples_of(supersample);
    RenderStats stats;
    value_or_throw(renderer_.draw(camera_, options_, frame, stats));
    for (const auto& [name, seconds] : render_seconds)
      if (seconds != &RenderStats::prepare) stats.*seconds += stats_.*seconds;
    stats_ = stats;
  }
  const RenderStats& stats() const { return stats_; }
  /// Largest supersampling that the index pass can draw.
  int limit() const {
    return std::min(max_supersample, index_pass_side_limit / std::max(size_.width, size_.height));
  }
  void set_interrupted(const std::atomic<bool>* interrupted) { options_.interrupted = interrupted; }

 private:
  Renderer& renderer_;
  FrameSize size_;
  const Camera& camera_;
  DrawOptions options_;
  RenderStats& stats_;
};

/// Blocks of a picture, chosen where it has most detail, and the errors that they tell of.
class Probe {
 public:
  Probe(Drawer& drawer, Frame first) : drawer_(drawer) {
    const int width = first.width;
    const int height = first.height;
    blocks_.across = (width + FrameBlocks::side - 1) / FrameBlocks::side;
    const int down = (height + FrameBlocks::side - 1) / FrameBlocks::side;
    std::vector<V3f> shown(first.pixels.size());
    parallel_for(0, height, [&](int y) {
      for (int x = 0; x < width; ++x)
        shown[index(width, x, y)] = display_value(first.pixels[index(width, x, y)]);
    });
    // Squares of second differences: what few rays miss is where they differ.
    std::vector<double> detail(static_cast<std::size_t>(blocks_.across) * down);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto at = [&](int i, int j) {
          return shown[index(width, std::clamp(x + i, 0, width - 1), std::clamp(y + j, 0, height - 1))];
        };
        const V3f mean = (at(-1, 0) + at(1, 0) + at(0, -1) + at(0, 1)) * 0.25F;
        detail[block_of(first, x, y)] += (at(0, 0) - mean).length2();
      }
    }
    choose(detail);
    last_ = std::move(first);
  }

  /// dB of the picture with half of this supersampling, which was drawn before.
  double accuracy_of_half(int supersample) {
    const Frame fine = draw(supersample);
    double sum = 0;
    for (int y = 0; y < fine.height; ++y) {
      for (int x = 0; x < fine.width; ++x) {
        const double weight = weights_[block_of(fine, x, y)];
        if (weight == 0) continue;
        const std::size_t i = index(fine.width, x, y);
        sum += weight * (display_value(last_.pixels[i]) - display_value(fine.pixels[i])).length2();
      }
    }
    last_ = fine;
    return decibels(sum / (3.0 * static_cast<double>(fine.pixels.size()))) - nearer(supersample / 2);
  }

 private:
  static std::size_t index(int width, int x, int y) { return static_cast<std::size_t>(y) * width + x; }
  std::size_t block_of(const Frame& frame, int x, int y) const {
    return index(blocks_.across, x / FrameBlocks::side, (frame.height - 1 - y) / FrameBlocks::side);
  }

  /// Takes blocks with probabilities by their detail, evenly spread over the picture (systematic sampling);
  /// a block counts by the inverse of its probability (Hansen and Hurwitz 1943).
  void choose(const std::vector<double>& detail) {
    constexpr double even = 0.2;  // of the probability goes to all blocks with any detail alike
    double whole = 0;
    std::size_t count = 0;
    for (const double d : detail) {
      whole += d;
      count += d > 0 ? 1 : 0;
    }
    blocks_.drawn.assign(detail.size(), 0);
    weights_.assign(detail.size(), 0);
    double sum = 0;
    int taken = 0;
    for (std::size_t i = 0; i < detail.size(); ++i) {
      if (detail[i] == 0) continue;
      const double probability = (1 - even) * detail[i] / whole + even / static_cast<double>(count);
      sum += probability;
      for (; taken < picks && (taken + 0.5) / picks <= sum; ++taken) {
        blocks_.drawn[i] = 1;
        weights_[i] += 1 / (picks * probability);
      }
    }
  }

  Frame draw(int supersample) {
    Frame frame;
    drawer_.draw(supersample, &blocks_, frame);
    return frame;
  }

  Drawer& drawer_;
  FrameBlocks blocks_;
  std::vector<double> weights_;  ///< of blocks
  Frame last_;
};

/// Draws with the least supersampling that has an accuracy, dB.
AccuratePicture draw_accurate(Drawer& drawer, double wanted, Frame& frame) {
  drawer.draw(std::min(2, drawer.limit()), nullptr, frame);
  if (drawer.limit() < 4) return {std::min(2, drawer.limit()), 0};
  Probe probe(drawer, frame);
  AccuratePicture picture{2, probe.accuracy_of_half(4)};
  if (picture.accuracy >= wanted) return picture;
  const double of_four = drawer.limit() < 8 ? picture.accuracy + gain_of_twice : probe.accuracy_of_half(8);
  // In between, accuracy goes with the logarithm of the rays.
  const double slope = (of_four - picture.accuracy) / std::log(2.0);
  for (const int supersample : {3, 4, 6, max_supersample}) {
    picture = {supersample, of_four + slope * std::log(supersample / 4.0)};
    if (picture.accuracy >= wanted || supersample >= drawer.limit()) break;
  }
  drawer.draw(picture.supersample, nullptr, frame);
  return picture;
}

/// Draws with the most supersampling that the time allows.
AccuratePicture draw_in_time(Drawer& drawer, Clock::time_point begin, double seconds, Frame& frame) {
  // Seconds go with this power of the rays along a side, at most.
  constexpr double power = 1.5;
  const auto now = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  drawer.draw(1, nullptr, frame);
  AccuratePicture picture{1, 0};
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
  double taken = 0;
  for (int next = std::min(2, drawer.limit()); next > picture.supersample;) {
    const double before = now();
    Frame finer;
    drawer.draw(next, nullptr, finer);
    if (drawer.stats().rows < finer.height) break;
    taken = now() - before;
    const double difference = decibels(mean_square(frame, finer));
    picture = {next, difference - nearer(picture.supersample) +
                         gain_of_twice * std::log2(1.0 * next / picture.supersample)};
    frame = std::move(finer);
    next = 0;
    for (const int larger : {3, 4, 6, max_supersample})
      if (larger > picture.supersample && larger <= drawer.limit() &&
          taken * std::pow(1.0 * larger / picture.supersample, power) < seconds - now())
        next = larger;
  }
  return picture;
}

}  // namespace

Result<AccuratePicture> draw_for(Renderer& renderer, const PictureGoal& goal, const FrameSize& size,
                                 const Camera& camera, DrawOptions options, Frame& frame,
                                 RenderStats& stats) {
  return result_of([&] {
    const Clock::time_point begin = Clock::now();
    stats = {};
    Drawer drawer(renderer, size, camera, options, stats);
    if (!goal.accuracy && !goal.seconds) {
      drawer.draw(size.supersample, nullptr, frame);
      return AccuratePicture{size.supersample, 0};
    }
    const AccuratePicture picture = goal.accuracy ? draw_accurate(drawer, *goal.accuracy, frame)
                                                  : draw_in_time(drawer, begin, *goal.seconds, frame);
    FrameSize left = size;
    left.supersample = picture.supersample;
    value_or_throw(renderer.resize(left));
    return picture;
  });
}

}  // namespace selvedge
