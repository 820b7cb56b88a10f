#include "viewer/accuracy.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
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

template <class Encode>
V3f display_value(const V4f& pixel, const Encode& encode) {
  static const DisplayOptions display = default_display();
  const V3f c = V3f(pixel.x, pixel.y, pixel.z) * display.exposure + *display.background * (1 - pixel.w);
  const auto encoded = [&](float x) { return encode(std::clamp(x, 0.0F, 1.0F)); };
  return {encoded(c.x), encoded(c.y), encoded(c.z)};
}
V3f display_value(const V4f& pixel) { return display_value(pixel, linear_to_srgb); }

double decibels(double mean_square) { return -10 * std::log10(std::max(mean_square, 1e-20)); }

/// Squares of the differences to the neighbours left and above, with which errors go.
double contrast_at(const Frame& frame, int x, int y) {
  const auto value = [&](std::size_t i) {
    return display_value(frame.pixels[i], [](float light) { return std::sqrt(light); });
  };
  const std::size_t i = static_cast<std::size_t>(y) * frame.width + x;
  const V3f here = value(i);
  return (here - value(i - 1)).length2() + (here - value(i - frame.width)).length2();
}

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

  /// Only pixels of `blocks`, if there are any. Throws a Failure.
  void draw(int supersample, const FrameBlocks* blocks, Frame& frame) {
    FrameSize size = size_;
    // Bands without blocks are not drawn.
    size.band_rows = blocks != nullptr ? blocks->side : band_rows(supersample);
    DrawOptions options = options_;
    options.blocks = blocks;
    draw(supersample, size, options, frame, blocks == nullptr);
  }
  /// Rows from `first_row` on, in bands of the size's. `counts`: the statistics count its pixels.
  void draw(int supersample, FrameSize size, DrawOptions& options, Frame& frame, bool counts) {
    size.supersample = supersample;
    value_or_throw(renderer_.resize(size));
    options.cells.samples = samples_of(std::max(supersample, options.foreseen));
    RenderStats stats;
    value_or_throw(renderer_.draw(camera_, options, frame, stats));
    add(stats, counts ? stats_ : unwanted_);
    if (counts) return;
    stats_.prepare = stats.prepare;
    for (const auto& [name, seconds] : render_seconds)
      if (seconds != &RenderStats::prepare) stats_.*seconds += stats.*seconds;
  }
  /// Largest supersampling that the index pass can draw.
  int limit() const {
    return std::min(max_supersample, index_pass_side_limit / std::max(size_.width, size_.height));
  }
  /// FrameSize::band_rows: images of close pictures fit for so many.
  int band_rows(int supersample) const {
    constexpr int bands = 16;
    constexpr std::size_t image_bytes = 320;  // of a pixel, close by
    const auto max_pixels =
        static_cast<int>(std::min(options_.cells.memory / image_bytes, std::size_t{1} << 20));
    const int rows = std::min(size_.height / bands, max_pixels / (size_.width * supersample * supersample));
    return std::max(rows / 2, 1) * 2;
  }
  const DrawOptions& options() const { return options_; }
  const RenderStats& stats() const { return stats_; }

 private:
  Renderer& renderer_;
  const FrameSize& size_;
  const Camera& camera_;
  const DrawOptions& options_;
  RenderStats& stats_;
  RenderStats unwanted_;
};

/// Blocks of a picture, spread evenly over it, drawn with several supersamplings: as many as it takes until
/// the standard error of an estimate is small.
class Probe {
 public:
  Probe(Drawer& drawer, const FrameSize& size) : drawer_(drawer), size_(size) {
    blocks_.across = (size.width + blocks_.side - 1) / blocks_.side;
    const int rows = (size.height + blocks_.side - 1) / blocks_.side;
    blocks_.drawn.resize(static_cast<std::size_t>(blocks_.across) * rows);
    taken_ = blocks_.drawn;
    row_step_ = std::clamp(rows / 8, 1, 4);
    all_ = static_cast<std::size_t>(blocks_.across) * (rows / row_step_);
  }

  /// dB of the picture with some supersampling beside that with another. Less exact where it is clearly below
  /// or above these.
  double accuracy(int supersample, int beside, double below = 0, double above = HUGE_VAL) {
    constexpr std::size_t min_blocks = 16;
    constexpr std::size_t max_blocks = 64;
    constexpr double max_error = 0.35;  // of the mean square
    constexpr double clear = 1.5;       // standard errors
    constexpr double few = 20;          // dB, by the blocks that show something
    if (count_ == 0) take(24);
    // As many as should show enough.
    const auto more = [&](std::size_t shown) {
      return shown < min_blocks ? count_ * (min_blocks - shown) / std::max<std::size_t>(shown, 1) + 2
                                : count_;
    };
    for (std::size_t shown = 0;; take(more(shown))) {
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
      const double reach = decibels(1 / (1 + clear * error)) + few / static_cast<double>(shown);
      const bool is_clear = result + reach < below || result - reach > above;
      const bool is_near = std::min(std::abs(result - below), std::abs(result - above)) < reach;
      const bool is_exact = error < max_error && (!is_near || shown > min_blocks);
      if (((is_clear || is_exact) && shown >= min_blocks) || shown >= max_blocks || count_ == all_)
        return result;
    }
  }

  /// Whether it took many blocks for some that show something: rays cost little then.
  bool is_mostly_empty() const { return count_ > 200; }

  /// dB by which a whole picture is less accurate than its blocks: errors go with the squares of the
  /// differences of neighbours.
  double beyond_blocks(const Frame& whole) const {
    constexpr double most = 3;
    std::array<double, 2> sums{};  // everywhere, and in blocks
    for (int y = 1; y < size_.height; ++y) {
      for (int x = 1; x < size_.width; ++x) {
        const double square = contrast_at(whole, x, y);
        sums[0] += square;
        if (taken_[block_row(y) + x / blocks_.side] != 0) sums[1] += square;
      }
    }
    const double part = 3.0 * size_.width * size_.height / static_cast<double>(pixels_);
    return sums[1] > 0 ? std::clamp(decibels(sums[0] / (sums[1] * part)), -most, most) : 0;
  }

 private:
  struct Drawn {
    Frame frame;
    std::vector<std::uint8_t> blocks;
  };

  std::size_t block_row(int y) const {
    return static_cast<std::size_t>((size_.height - 1 - y) / blocks_.side) * blocks_.across;
  }

  /// Calls body(pixel, block) for the pixels of blocks.
  template <class Body>
  void for_each_pixel(const std::vector<std::uint8_t>& blocks, const Body& body) const {
    for (int y = 0; y < size_.height; ++y) {
      const std::size_t row = block_row(y);
      for (int x = 0; x < size_.width; ++x)
        if (const std::size_t block = row + x / blocks_.side; blocks[block] != 0)
          body(static_cast<std::size_t>(y) * size_.width + x, block);
    }
  }

  /// Takes more blocks, as many as there are, by multiples of the golden ratio.
  void take(std::size_t more) {
    for (; more > 0 && count_ < all_; ++next_) {
      const double place = next_ * std::numbers::phi;
      const auto number = static_cast<std::size_t>((place - std::floor(place)) * static_cast<double>(all_));
      const std::size_t row = number / blocks_.across * row_step_ + row_step_ / 2;
      std::uint8_t& block = taken_[row * blocks_.across + number % blocks_.across];
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
    drawer_.draw(supersample, &blocks_, more);
    if (frame.pixels.empty()) frame = more;
    for_each_pixel(blocks_.drawn, [&](std::size_t i, std::size_t) { frame.pixels[i] = more.pixels[i]; });
    blocks = taken_;
    return frame;
  }

  Drawer& drawer_;
  FrameSize size_;
  FrameBlocks blocks_;
  std::vector<std::uint8_t> taken_;
  int row_step_ = 1;       ///< other rows have no blocks: OpenGL draws whole rows
  std::size_t all_ = 0;    ///< that may be taken
  std::size_t count_ = 0;  ///< of taken_
  int next_ = 1;
  std::map<int, Drawn> drawn_;
  std::size_t pixels_ = 0;  ///< of taken_, channels counted
};

/// Draws with the least supersampling that has an accuracy, dB.
AccuratePicture draw_accurate(Drawer& drawer, double wanted, const FrameSize& size, Frame& frame) {
  AccuratePicture picture{std::min(2, drawer.limit()), 0};
  Probe probe(drawer, size);
  if (drawer.limit() >= 4) {
    const auto is_enough = [&](int supersample, double decibels) {
      picture = {supersample, decibels};
      return picture.accuracy >= wanted;
    };
    const double of_two = probe.accuracy(2, 4, wanted, wanted);
    const double of_one = of_two > wanted + for_one + gain_of_two && !probe.is_mostly_empty()
                              ? probe.accuracy(1, 4, wanted + for_one, wanted + for_one)
                              : 0;
    if (of_one >= wanted + for_one) {
      picture = {1, of_one};
    } else if (!is_enough(2, of_two)) {
      const bool has_eight = drawer.limit() >= 8;
      const double of_four = has_eight ? probe.accuracy(4, 8) : of_two + gain_of_twice;
      const double before = has_eight ? probe.accuracy(2, 8) : of_two;
      // In between, accuracy goes with the logarithm of the rays.
      for (const int supersample : {3, 4, 6, max_supersample})
        if (supersample > drawer.limit() ||
            is_enough(supersample, of_four + (of_four - before) * std::log2(supersample / 4.0)))
          break;
    }
  }
  drawer.draw(picture.supersample, nullptr, frame);
  if (picture.accuracy > 0) picture.accuracy += probe.beyond_blocks(frame);
  return picture;
}

/// A picture in strips of rows, each with as many rays as there is time for.
class TimedPicture {
 public:
  TimedPicture(Drawer& drawer, double seconds, const FrameSize& size, Frame& frame)
      : drawer_(drawer), seconds_(use * seconds), size_(size), frame_(frame) {
    size_.band_rows = drawer.band_rows(4);
    frame_ = {size.width, size.height, std::vector<V4f>(static_cast<std::size_t>(size.width) * size.height)};
    steps_of_.resize((size_.height + size_.band_rows - 1) / size_.band_rows, -1);
    while (steps_ > 1 && rays[steps_ - 1] > drawer.limit()) --steps_;
  }

  AccuratePicture draw() {
    foresee(std::min(1, steps_ - 1));
    seconds_ -= drawer_.stats().prepare;
    while (draw_worst()) {
    }
    AccuratePicture picture;
    for (std::size_t i = 0; i < steps_of_.size(); ++i)
      picture.rows[rays[steps_of_[i]]] += std::min(size_.height - row_of(i), size_.band_rows);
    picture.supersample =
        std::ranges::max_element(picture.rows, {}, [](const auto& p) { return p.second; })->first;
    double error = 0;
    for (std::size_t i = 0; i < steps_of_.size(); ++i) error += contrast(i, i + 1) * error_with(steps_of_[i]);
    if (redrawn_contrast_ > 0)
      picture.accuracy =
          decibels(error * redrawn_squares_ / redrawn_contrast_ / (3.0 * size_.width * size_.height));
    return picture;
  }

 private:
  static constexpr std::array rays{1, 2, 3, 4, 6, max_supersample};  ///< along a side, by steps
  static constexpr double use = 0.95;                                ///< of the time
  static constexpr double measured = 0.05;                           ///< of the picture
  static constexpr double cost_of_pixel = 1;                         ///< as RenderStats::image_cost

  /// Mean square of errors; 1 with one ray a pixel.
  static double error_with(int step) { return std::pow(10, -gain_of_twice / 10 * std::log2(rays[step])); }
  /// Sum of contrast_at() in some strips.
  double contrast(std::size_t first, std::size_t end) const {
    double sum = 0;
    for (int y = std::max(size_.height - row_of(end), 1); y < size_.height - row_of(first); ++y)
      for (int x = 1; x < size_.width; ++x) sum += contrast_at(frame_, x, y);
    return sum;
  }
  double left() const { return seconds_ - std::chrono::duration<double>(Clock::now() - begin_).count(); }
  int row_of(std::size_t strip) const { return static_cast<int>(strip) * size_.band_rows; }

  /// Finds the costs of strips with so many rays.
  void foresee(int step) {
    if (!costs_[step].empty()) return;
    double before = 0;
    DrawOptions options = drawer_.options();
    options.foreseen = rays[step];
    options.goes_on = [&](const RenderStats& stats) {
      const double pixels = static_cast<double>(stats.covered_pixels) + 0.02 * size_.width * stats.rows;
      const double here = cost_of_pixel * rays[step] * rays[step] * (pixels - std::exchange(before, pixels));
      costs_[step].push_back({here + stats.image_cost.all, here + stats.image_cost.fresh});
      return true;
    };
    drawer_.draw(1, size_, options, part_, false);
  }
  /// Cost of some strips; `goes_on`: the strip before them was drawn just now with as many rays.
  double cost(int step, std::size_t first, std::size_t end, bool goes_on = false) const {
    const auto& costs = costs_[step];
    if (costs.empty()) return HUGE_VAL;
    double sum = goes_on ? 0 : costs[first].all - costs[first].fresh;
    for (std::size_t i = first; i < end; ++i) sum += costs[i].fresh;
    return sum;
  }
  /// The same in seconds.
  double expected(int step, std::size_t first, std::size_t end, bool goes_on = false) const {
    int known = step;
    while (known > 0 && paces_[known].cost == 0) --known;
    while (known < steps_ - 1 && paces_[known].cost == 0) ++known;
    return cost(step, first, end, goes_on) * paces_[known].seconds / paces_[known].cost;
  }
  /// Draws strips with the fewest rays, or with none yet, again with more. Returns whether there was time.
  bool draw_worst() {
    const auto worst = std::ranges::min_element(steps_of_);
    const auto other = std::find_if(worst, steps_of_.end(), [&](int step) { return step != *worst; });
    const std::size_t first = worst - steps_of_.begin();
    const std::size_t end = other - steps_of_.begin();
    const int least = *worst + 1;
    if (least == steps_) return false;
    // The first strips tell how fast this machine is.
    if (first == 0 && least == 0) {
      const int step = std::min(1, steps_ - 1);
      draw_run(0, step,
               [&](std::size_t next) { return cost(step, 0, next) < measured * cost(step, 0, end); });
      return true;
    }
    constexpr double worth = 2;  // of the time
    for (int step = std::max(least, 1); step < steps_; ++step) {
      foresee(step);
      if (expected(step, first, end) > worth * left()) break;
    }
    // The most rays for which all have time, or where few are left as many as before.
    const auto affordable = [&](std::size_t next, int now) {
      const bool are_few = now > 0 && 3 * (steps_of_.size() - next) < steps_of_.size();
      int step = are_few ? now : steps_ - 1;
      while (step > least && expected(step, next, end, step == now) > left() - (step == now ? 0 : start_))
        --step;
      return step;
    };
    int step = affordable(first, -1);
    if (least > 0) {
      const auto fits = [&](std::size_t next) {
        return next < end && expected(step, next, next + 1, next > first) <= left();
      };
      if (start_ + expected(step, first, first + 1) > left()) return false;
      draw_run(first, step, fits);
      return true;
    }
    if (step == 0 && steps_ > 1) {
      // One ray takes nearly as long as 2 x 2, or much less.
      constexpr double much_less = 0.6;
      foresee(0);
      step = expected(0, first, end) < much_less * expected(1, first, end) ? 0 : 1;
    }
    draw_run(first, step,
             [&](std::size_t next) { return std::max(affordable(next, step), 1) == std::max(step, 1); });
    return true;
  }

  /// Draws strips on from `first`, the next while `goes_on`; returns the one behind them.
  std::size_t draw_run(std::size_t first, int step, const std::function<bool(std::size_t)>& goes_on) {
    std::size_t next = first;
    const int before_step = steps_of_[first];
    double before = left();
    DrawOptions options = drawer_.options();
    options.first_row = row_of(first);
    options.goes_on = [&](const RenderStats& stats) {
      double taken = before - left();
      if (next == first) taken -= start_ = stats.project;
      Pace& pace = paces_[step];
      pace = {0.7 * pace.seconds + taken, 0.7 * pace.cost + cost(step, next, next + 1, next > first)};
      steps_of_[next++] = step;
      before = left();
      return next < steps_of_.size() && goes_on(next);
    };
    drawer_.draw(rays[step], size_, options, part_, true);
    const auto from = [&](std::size_t strip) {
      return static_cast<std::ptrdiff_t>(std::max(size_.height - row_of(strip), 0)) * size_.width;
    };
    for (std::ptrdiff_t i = from(next); before_step >= 0 && i < from(first); ++i)
      redrawn_squares_ += (display_value(part_.pixels[i]) - display_value(frame_.pixels[i])).length2();
    std::copy(part_.pixels.begin() + from(next), part_.pixels.begin() + from(first),
              frame_.pixels.begin() + from(next));
    if (before_step >= 0)
      redrawn_contrast_ += contrast(first, next) * (error_with(before_step) - error_with(step));
    return next;
  }

  struct Pace {
    double seconds = 0, cost = 0;  ///< of the latest strips, the more the later they were
  };
  Clock::time_point begin_ = Clock::now();
  Drawer& drawer_;
  double seconds_;
  FrameSize size_;
  Frame& frame_;
  Frame part_;
  int steps_ = static_cast<int>(rays.size());  ///< that can be drawn
  double start_ = 0;                           ///< seconds before the first strip of a run
  // Strips that were drawn again: squares of the differences, and contrast times what error_with() fell by.
  double redrawn_squares_ = 0, redrawn_contrast_ = 0;
  std::vector<int> steps_of_;                              ///< of strips, from the lowest on; -1: not drawn
  std::array<std::vector<ImageCost>, rays.size()> costs_;  ///< of strips, by steps
  std::array<Pace, rays.size()> paces_;
};

}  // namespace

void add(const RenderStats& one, RenderStats& sum) {
  for (const auto& [name, seconds] : render_seconds) sum.*seconds += one.*seconds;
  sum.prepare = one.prepare;
  sum.triangles = one.triangles;
  sum.covered_pixels += one.covered_pixels;
  sum.evaluated_pixels += one.evaluated_pixels;
  sum.layers = std::max(sum.layers, one.layers);
  sum.image_bytes = std::max(sum.image_bytes, one.image_bytes);
  if (one.remarks.size() >= sum.remarks.size()) sum.remarks = one.remarks;
}

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
    AccuratePicture picture = goal.accuracy ? draw_accurate(drawer, *goal.accuracy, size, frame)
                                            : TimedPicture(drawer, *goal.seconds, size, frame).draw();
    FrameSize left = size;
    left.supersample = picture.supersample;
    left.band_rows = drawer.band_rows(left.supersample);
    value_or_throw(renderer.resize(left));
    return picture;
  });
}

}  // namespace selvedge
