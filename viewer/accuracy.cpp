#include "viewer/accuracy.h"

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/base/srgb.h"
#include "viewer/scene/material.h"

namespace selvedge {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int max_supersample = 8;
/// dB that twice the rays along a pixel's side give, about (tests/bench/accuracy.mjs).
constexpr double db_per_doubling = 6.5;

template <class Encode>
V3f display_value(const V4f& pixel, const DisplayOptions& display, const Encode& encode) {
  const V3f c = display_colour(pixel, display);
  const auto encoded = [&](float x) { return encode(std::clamp(x, 0.0F, 1.0F)); };
  return {encoded(c.x), encoded(c.y), encoded(c.z)};
}

/// Square of the difference of two pixels as displayed.
double square_error(const V4f& a, const V4f& b, const DisplayOptions& display) {
  return (display_value(a, display, linear_to_srgb) - display_value(b, display, linear_to_srgb)).length2();
}

DisplayOptions over_white(DisplayOptions display) {
  if (!display.background) display.background = V3f(1, 1, 1);
  return display;
}

/// Rays along a pixel's side, and CellImageOptions::max_patch_rays_per_side.
struct Rays {
  int side = 1;
  float max_patch = CellImageOptions{}.max_patch_rays_per_side;
  auto operator<=>(const Rays&) const = default;
};
/// More accurate than 2 x 2 rays and not much dearer: what makes pictures dear is the number of patches.
constexpr std::array<Rays, 2> many_on_coarse_patches{{{4, 2.4F}, {4, 3.2F}}};

/// Rays of pixels through whose holes something else shows, where 2 x 2 do for the others.
constexpr Rays hole_rays{max_supersample, 2};
/// Added to the dB that the picture has to spare, above which a gain is worth it: these pixels may take as
/// long as all others together.
constexpr double min_gain_db = 1;

double decibels(double mean_square) { return -10 * std::log10(std::max(mean_square, 1e-20)); }

/// Squares of the differences to the neighbours left and above, to which errors are proportional.
double contrast_at(const Frame& frame, const DisplayOptions& display, int x, int y) {
  const auto value = [&](std::size_t i) {
    return display_value(frame.pixels[i], display, [](float light) { return std::sqrt(light); });
  };
  const std::size_t i = static_cast<std::size_t>(y) * frame.width + x;
  const V3f here = value(i);
  return (here - value(i - 1)).length2() + (here - value(i - frame.width)).length2();
}

/// Marks pixels of cloth in which what lies behind shows strongly, and with them the outlines of cloth; none
/// where the former are so few that a further picture is not worth its setting-up.
std::vector<std::uint8_t> find_holes(const Frame& frame, const DisplayOptions& display) {
  constexpr float visible = 12.0F / 255;
  constexpr int min_share = 32;
  std::vector<std::uint8_t> found(frame.pixels.size());
  const auto is_cloth = [&](int x, int y) {  // shadows on the floor are black
    const V4f& pixel = frame.pixels[static_cast<std::size_t>(y) * frame.width + x];
    return pixel.x + pixel.y + pixel.z > 0;
  };
  std::atomic<int> holes = 0, cloth = 0;
  parallel_for(0, frame.height, [&](int y) {
    for (int x = 0; x < frame.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * frame.width + x;
      const V4f& pixel = frame.pixels[i];
      const bool is_here = is_cloth(x, y);
      for (int v = std::max(y - 1, 0); v <= std::min(y + 1, frame.height - 1); ++v)
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, frame.width - 1); ++u)
          if (is_cloth(u, v) != is_here) found[i] = 1;
      if (found[i] != 0 || !is_here) continue;
      ++cloth;
      const V3f change = display_value(pixel, display, linear_to_srgb) -
                         display_value(pixel / pixel.w, display, linear_to_srgb);
      if (std::max({std::abs(change.x), std::abs(change.y), std::abs(change.z)}) < visible) continue;
      found[i] = 1;
      ++holes;
    }
  });
  return min_share * holes > cloth ? found : std::vector<std::uint8_t>();
}

/// Draws a view with any supersampling.
struct Drawer {
  Renderer& renderer;
  const FrameSize& size;
  const Camera& camera;
  const DrawOptions& options;
  DisplayOptions display;
  std::span<const Tints> tints;
  RenderStats& stats;

  /// Draws the whole pictures; with `blocks` only their pixels, without a place in the statistics but their
  /// times. Throws a Failure.
  void draw(const Rays& rays, const FrameBlocks* blocks, std::span<const Tints> drawn_tints,
            std::vector<Frame>& frames) {
    FrameSize drawn_size = size;
    drawn_size.supersample = rays.side;
    // Bands without blocks are not drawn.
    drawn_size.band_rows = blocks != nullptr ? 8 : band_rows(rays.side);
    DrawOptions drawn = options;
    drawn.cells.samples_per_pixel_side = image_samples(rays.side);
    drawn.cells.max_patch_rays_per_side = rays.max_patch;
    // Few bands share images of single pixels.
    if (blocks != nullptr && blocks->block_size == 1) drawn.cells.memory_bytes /= 4;
    drawn.blocks = blocks;
    const RenderStats own = draw(drawn_size, drawn, drawn_tints, frames);
    if (blocks == nullptr) keep(own);
  }
  /// Draws these pixels of a picture again.
  void draw_again(const Rays& rays, const std::vector<std::uint8_t>& pixels, std::span<const Tints> tint,
                  Frame& frame) {
    const auto width = static_cast<std::size_t>(size.width);
    FrameBlocks blocks{1, size.width, {}};
    for (std::size_t row = size.height; row-- > 0;)
      blocks.is_drawn.insert(blocks.is_drawn.end(), &pixels[row * width], &pixels[row * width] + width);
    std::vector<Frame> again;
    draw(rays, &blocks, tint, again);
    for (std::size_t i = 0; i < pixels.size(); ++i)
      if (pixels[i] != 0) frame.pixels[i] = again[0].pixels[i];
  }
  /// The same with any options. Adds to the times of the statistics; returns the frame's own ones.
  RenderStats draw(const FrameSize& drawn_size, const DrawOptions& drawn, std::span<const Tints> drawn_tints,
                   std::vector<Frame>& frames) {
    RenderStats own;
    value_or_throw(renderer.resize(drawn_size));
    value_or_throw(renderer.draw(camera, drawn, drawn_tints, frames, own));
    for (const auto& [name, seconds] : render_seconds)
      if (seconds != &RenderStats::prepare_seconds) stats.*seconds += own.*seconds;
    stats.prepare_seconds = own.prepare_seconds;
    return own;
  }
  /// Replaces the statistics by a frame's, except for the times, which add up over all frames.
  void keep(RenderStats own) {
    for (const auto& [name, seconds] : render_seconds) own.*seconds = stats.*seconds;
    stats = std::move(own);
  }
  /// Largest supersampling that the index pass can draw.
  int limit() const { return std::min(max_supersample, max_frame_side / std::max(size.width, size.height)); }
  /// FrameSize::band_rows: a picture has at least `min_bands`, which cost no time, and as many as let the
  /// cell images of a band fit into the memory. Those take `image_bytes` for a pixel of a sweater close by.
  int band_rows(int supersample) const {
    constexpr int min_bands = 16;
    constexpr std::size_t image_bytes = 320;
    const auto max_pixels =
        static_cast<int>(std::min(options.cells.memory_bytes / image_bytes, std::size_t{1} << 20));
    const int rows = std::min(size.height / min_bands, max_pixels / (size.width * supersample * supersample));
    return std::max(rows / 2, 1) * 2;
  }
};

/// Pictures at the blocks that some estimate has taken.
struct DrawnBlocks {
  std::vector<Frame> frames;
  std::vector<std::uint8_t> blocks;
};
using BlocksByRays = std::map<Rays, DrawnBlocks>;

/// Blocks of one of the pictures, spread evenly over it, drawn with several numbers of rays: as many as it
/// takes until the standard error of an estimate is small.
class Probe {
 public:
  /// `drawn` is shared by the pictures.
  Probe(Drawer& drawer, std::size_t picture, BlocksByRays& drawn)
      : drawer_(drawer), picture_(picture), drawn_(drawn) {
    blocks_.columns = (size_.width + blocks_.block_size - 1) / blocks_.block_size;
    const int rows = (size_.height + blocks_.block_size - 1) / blocks_.block_size;
    blocks_.is_drawn.resize(static_cast<std::size_t>(blocks_.columns) * rows);
    taken_ = blocks_.is_drawn;
    row_step_ = std::clamp(rows / 8, 1, 4);
    all_ = static_cast<std::size_t>(blocks_.columns) * (rows / row_step_);
  }

  /// dB of the picture with some rays compared with others. Less exact where it is clearly
  /// below or above these.
  double accuracy(const Rays& rays, const Rays& reference, double below = 0, double above = HUGE_VAL) {
    // Chosen on random pictures of tests/bench/accuracy.mjs, so that an estimate costs a tenth of a picture.
    constexpr std::size_t first_blocks = 24;
    constexpr std::size_t min_blocks = 16;          // that show something
    constexpr std::size_t max_blocks = 64;          // that show something
    constexpr double max_error = 0.35;              // standard error of the mean square, as a part of it
    constexpr double confidence_sigmas = 1.5;       // of an estimate clearly above or below
    constexpr double small_sample_penalty_db = 20;  // by the blocks that show something
    if (count_ == 0) take(first_blocks);
    // As many as should show enough.
    const auto more = [&](std::size_t shown) {
      return shown < min_blocks ? count_ * (min_blocks - shown) / std::max<std::size_t>(shown, 1) + 2
                                : count_;
    };
    for (std::size_t shown = 0;; take(more(shown))) {
      double sum = 0;
      double squares = 0;
      shown = 0;  // blocks with something in them: others cost nothing, and say little
      for (const double square : block_errors(rays, reference)) {
        sum += square;
        squares += square * square;
        shown += square > 0 ? 1 : 0;
      }
      // Variance of a sum of independent blocks: the sum of squares less the square of their sum over their
      // number.
      const double error =
          std::sqrt(std::max(squares / (sum * sum) - 1.0 / static_cast<double>(count_), 0.0));
      const double result = decibels(sum / static_cast<double>(pixels_));
      const double margin = decibels(1 / (1 + confidence_sigmas * error)) +
                            small_sample_penalty_db / static_cast<double>(shown);
      const bool is_clear = result + margin < below || result - margin > above;
      const bool is_near = std::min(std::abs(result - below), std::abs(result - above)) < margin;
      const bool is_exact = error < max_error && (!is_near || shown > min_blocks);
      if (((is_clear || is_exact) && shown >= min_blocks) || shown >= max_blocks || count_ == all_ ||
          drawer_.options.is_interrupted())
        return result;
    }
  }

  bool has_errors() const { return !errors_.empty(); }
  /// Keeps the errors of pixels compared with others.
  void keep_errors(const Rays& rays, const Rays& reference) {
    const Frame& a = drawn(rays);
    const Frame& b = drawn(reference);
    for_each_pixel(taken_, [&](std::size_t i, std::size_t) {
      errors_.push_back({i, square_error(a.pixels[i], b.pixels[i], drawer_.display)});
    });
  }
  /// By those, dB of the picture with these pixels drawn again with hole_rays.
  double accuracy_without(const std::vector<std::uint8_t>& pixels) const {
    constexpr double left = 0.08;  // of squares, on a plain knit
    double sum = 0;
    for (const auto& [i, square] : errors_) sum += square * (pixels[i] != 0 ? left : 1);
    return decibels(sum / (3 * static_cast<double>(errors_.size())));
  }

  /// A whole picture, of which no blocks are drawn.
  void take_whole(const Rays& rays, const Frame& frame) {
    drawn_[rays] = {{frame}, std::vector<std::uint8_t>(taken_.size(), 1)};
  }

  /// dB by which a whole picture is more accurate than its blocks, as far as their contrasts differ.
  double correction_db(const Frame& whole) const {
    constexpr double max_correction_db = 3;  // errors follow contrasts loosely
    std::array<double, 2> sums{};            // everywhere, and in blocks
    for (int y = 1; y < size_.height; ++y) {
      for (int x = 1; x < size_.width; ++x) {
        const double square = contrast_at(whole, drawer_.display, x, y);
        sums[0] += square;
        if (taken_[block_row(y) + x / blocks_.block_size] != 0) sums[1] += square;
      }
    }
    const double part = 3.0 * size_.width * size_.height / static_cast<double>(pixels_);
    return sums[1] > 0
               ? std::clamp(decibels(sums[0] / (sums[1] * part)), -max_correction_db, max_correction_db)
               : 0;
  }

 private:
  std::size_t block_row(int y) const {
    return static_cast<std::size_t>((size_.height - 1 - y) / blocks_.block_size) * blocks_.columns;
  }

  /// Calls body(pixel, block) for the pixels of blocks.
  template <class Body>
  void for_each_pixel(const std::vector<std::uint8_t>& blocks, const Body& body) const {
    for (int y = 0; y < size_.height; ++y) {
      const std::size_t row = block_row(y);
      for (int x = 0; x < size_.width; ++x)
        if (const std::size_t block = row + x / blocks_.block_size; blocks[block] != 0)
          body(static_cast<std::size_t>(y) * size_.width + x, block);
    }
  }

  /// Takes more blocks, as many as there are, by multiples of the golden ratio.
  void take(std::size_t more) {
    for (; more > 0 && count_ < all_; ++next_) {
      const double place = next_ * std::numbers::phi;
      const auto number = static_cast<std::size_t>((place - std::floor(place)) * static_cast<double>(all_));
      const std::size_t row = number / blocks_.columns * row_step_ + row_step_ / 2;
      std::uint8_t& block = taken_[row * blocks_.columns + number % blocks_.columns];
      if (std::exchange(block, 1) != 0) continue;
      ++count_;
      --more;
    }
  }

  /// Squares of the differences of the blocks that are taken, and how many there are.
  std::vector<double> block_errors(const Rays& rays, const Rays& reference) {
    const Frame& a = drawn(rays);
    const Frame& b = drawn(reference);
    std::vector<double> squares(taken_.size());
    pixels_ = 0;
    for_each_pixel(taken_, [&](std::size_t i, std::size_t block) {
      squares[block] += square_error(a.pixels[i], b.pixels[i], drawer_.display);
      pixels_ += 3;
    });
    return squares;
  }

  /// The picture at the blocks that are taken.
  const Frame& drawn(const Rays& rays) {
    DrawnBlocks& known = drawn_[rays];
    known.blocks.resize(taken_.size());
    for (std::size_t i = 0; i < taken_.size(); ++i)
      blocks_.is_drawn[i] = taken_[i] != 0 && known.blocks[i] == 0 ? 1 : 0;
    if (std::ranges::find(blocks_.is_drawn, 1) == blocks_.is_drawn.end()) return known.frames[picture_];
    std::vector<Frame> more;
    drawer_.draw(rays, &blocks_, drawer_.tints, more);
    if (known.frames.empty()) known.frames = more;
    for_each_pixel(blocks_.is_drawn, [&](std::size_t i, std::size_t) {
      for (std::size_t k = 0; k < more.size(); ++k) known.frames[k].pixels[i] = more[k].pixels[i];
    });
    for (std::size_t i = 0; i < taken_.size(); ++i) known.blocks[i] |= taken_[i];
    return known.frames[picture_];
  }

  Drawer& drawer_;
  const FrameSize& size_ = drawer_.size;
  FrameBlocks blocks_;
  std::vector<std::uint8_t> taken_;
  int row_step_ = 1;       ///< other rows have no blocks: OpenGL draws whole rows
  std::size_t all_ = 0;    ///< that may be taken
  std::size_t count_ = 0;  ///< of taken_
  int next_ = 1;
  std::size_t picture_;
  BlocksByRays& drawn_;
  std::size_t pixels_ = 0;                              ///< of taken_, channels counted
  std::vector<std::pair<std::size_t, double>> errors_;  ///< of keep_errors(), by pixel
};

/// The least rays that have an accuracy, dB, which is estimated in `picture`.
Rays choose_rays(const Drawer& drawer, double wanted, Probe& probe, AccuratePicture& picture) {
  Rays rays{std::min(2, drawer.limit())};
  if (drawer.limit() < 4) return rays;
  const auto is_enough = [&](const Rays& tried, double decibels) {
    rays = tried;
    picture.accuracy_db = decibels;
    return decibels >= wanted;
  };
  const double db_2x2 = probe.accuracy({2}, {4}, wanted, wanted);
  if (is_enough({2}, db_2x2)) return rays;
  for (const Rays& coarse : many_on_coarse_patches) {
    const double square = std::pow(10, -probe.accuracy(coarse, {4}, wanted, wanted) / 10);
    // The reference has errors of its own.
    if (is_enough(coarse, decibels(square + std::pow(10, -(db_2x2 + db_per_doubling) / 10)))) return rays;
  }
  constexpr double clear_db = 1;
  if (is_enough({4}, db_2x2 + db_per_doubling) && picture.accuracy_db >= wanted + clear_db) return rays;
  const bool has_eight = drawer.limit() >= 8;
  const double db_4x4 = has_eight ? probe.accuracy({4}, {8}) : db_2x2 + db_per_doubling;
  const double db_2x2_vs_8x8 = has_eight ? probe.accuracy({2}, {8}) : db_2x2;
  // In between, accuracy goes with the logarithm of the rays.
  for (const int side : {4, 6, max_supersample})
    if (side > drawer.limit() || is_enough({side}, db_4x4 + (db_4x4 - db_2x2_vs_8x8) * std::log2(side / 4.0)))
      break;
  return rays;
}

/// Draws pictures with the least rays that each needs for an accuracy, dB.
std::vector<AccuratePicture> draw_accurate(Drawer& drawer, double wanted, std::vector<Frame>& frames) {
  const std::span<const Tints> tints = drawer.tints;
  std::vector<AccuratePicture> pictures(tints.size());
  std::vector<Probe> probes;
  BlocksByRays drawn;
  std::map<Rays, std::vector<std::size_t>> by_rays;
  for (std::size_t i = 0; i < tints.size(); ++i) {
    const Rays rays = choose_rays(drawer, wanted, probes.emplace_back(drawer, i, drawn), pictures[i]);
    pictures[i].supersample = rays.side;
    by_rays[rays].push_back(i);
    if (rays.side == 2 && pictures[i].accuracy_db >= default_accuracy_db) probes[i].keep_errors({2}, {4});
  }
  drawn.clear();
  frames.resize(tints.size());
  for (const auto& [rays, numbers] : by_rays) {
    std::vector<Tints> chosen;
    for (const std::size_t i : numbers) chosen.push_back(tints[i]);
    std::vector<Frame> made;
    drawer.draw(rays, nullptr, chosen, made);
    for (std::size_t k = 0; k < numbers.size(); ++k) frames[numbers[k]] = std::move(made[k]);
  }
  for (std::size_t i = 0; i < tints.size(); ++i) {
    if (!(pictures[i].accuracy_db > 0)) continue;
    const double correction = probes[i].correction_db(frames[i]);
    if (probes[i].has_errors()) {
      const std::vector<std::uint8_t> holes = find_holes(frames[i], drawer.display);
      const double without = holes.empty() ? 0 : probes[i].accuracy_without(holes);
      const double spare_db = pictures[i].accuracy_db - wanted;
      if (without > pictures[i].accuracy_db + spare_db + min_gain_db) {
        pictures[i].accuracy_db = without;
        drawer.draw_again(hole_rays, holes, tints.subspan(i, 1), frames[i]);
      }
    }
    pictures[i].accuracy_db += correction;
  }
  return pictures;
}

/// A whole picture on the way to the best one that a time allows.
struct Wave {
  enum class Images { moving, quick, rest };
  Images images = Images::moving;
  int magnification = 1;  ///< pixels of the picture along the side of a pixel that is drawn
  int supersample = 1;
};

/// The first wave has at most this many pixels: they take 0.1 s of two cores.
constexpr int first_wave_pixels = 1 << 15;
/// Between frames that move and pictures at rest: a third of the time of the latter, and dB in the middle.
constexpr CellImageOptions quick_cell_images{
    .samples_per_pixel_side = 3.5F,  // fewer than at rest, where these images are made again
    .patches = {.max_turn_degree_pixels = 320,
                .max_turn_degrees = 8,
                .max_outline_pixels = 8,
                .max_offset_pixels = 2},
    .hair_shadows = false,
    .shading_block_size = 2,
    .shadow_texels_per_pixel = 1,
    .max_piece_pixels = 2,
    .min_transparency = 3.0F / 255,
};

Wave first_wave(const FrameSize& size) {
  Wave wave;
  while (size.width / wave.magnification * (size.height / wave.magnification) > first_wave_pixels)
    wave.magnification *= 2;
  return wave;
}

/// The wave after one that took some seconds of those that are left; none: there is no time for it.
std::optional<Wave> next_wave(const Wave& wave, double taken, double left, int limit) {
  using enum Wave::Images;
  // Times a wave with other images takes as long as the one before it: medians of 11 views of a sweater and
  // swatches at 320 x 256.
  constexpr double quick_time_ratio = 5;
  constexpr double rest_time_ratio = 2;
  if (wave.magnification > 1) return Wave{moving, wave.magnification / 2, 1};
  if (wave.images == moving && limit >= 2 && quick_time_ratio * taken < left) return Wave{quick, 1, 2};
  if (wave.images == quick && rest_time_ratio * taken < left) return Wave{rest, 1, 2};
  if (wave.images != rest) return std::nullopt;
  // The time of a picture grows with this power of the rays along a side: median of fixed rays in
  // tests/bench/accuracy.mjs --seconds.
  constexpr double time_exponent = 1.75;
  const double larger = std::pow(left / taken, 1 / time_exponent);
  const int supersample = std::min(static_cast<int>(std::min(wave.supersample * larger, 1e3)), limit);
  return supersample > wave.supersample ? std::optional(Wave{rest, 1, supersample}) : std::nullopt;
}

/// A smaller frame in the size of the picture, bilinear.
Frame magnify(const Frame& small, const FrameSize& size) {
  struct Tap {
    int first, next;
    float part;
  };
  const auto tap = [](int i, int count, int all) {
    const float place = std::clamp(
        (static_cast<float>(i) + 0.5F) * static_cast<float>(count) / static_cast<float>(all) - 0.5F, 0.0F,
        static_cast<float>(count - 1));
    const int first = static_cast<int>(place);
    return Tap{first, std::min(first + 1, count - 1), place - static_cast<float>(first)};
  };
  Frame large{size.width, size.height, {}};
  large.pixels.resize(static_cast<std::size_t>(size.width) * size.height);
  parallel_for(0, size.height, [&](int y) {
    const Tap v = tap(y, small.height, size.height);
    for (int x = 0; x < size.width; ++x) {
      const Tap u = tap(x, small.width, size.width);
      const auto row = [&](int k) {
        const V4f* const pixels = &small.pixels[static_cast<std::size_t>(k) * small.width];
        return pixels[u.first] * (1 - u.part) + pixels[u.next] * u.part;
      };
      large.pixels[static_cast<std::size_t>(y) * size.width + x] =
          row(v.first) * (1 - v.part) + row(v.next) * v.part;
    }
  });
  return large;
}

/// dB of a whole picture, by its blocks; none: the time of the drawer's options ends before they are drawn.
std::optional<double> accuracy_of(const Frame& frame, int supersample, Drawer& drawer) {
  const int reference = std::min(2 * supersample, drawer.limit());
  if (reference < 2 * supersample && drawer.limit() < max_supersample) return std::nullopt;
  BlocksByRays drawn;
  Probe probe(drawer, 0, drawn);
  if (2 * supersample <= max_supersample) probe.take_whole({supersample}, frame);
  // Beyond half of max_supersample no reference has twice the rays: what more rays give is added.
  const int compared = std::min(supersample, max_supersample / 2);
  const double accuracy = probe.accuracy({compared}, {reference}) +
                          db_per_doubling * std::log2(static_cast<double>(supersample) / compared);
  return drawer.options.is_interrupted() ? std::nullopt
                                         : std::optional(accuracy + probe.correction_db(frame));
}

/// Draws whole pictures, each with more rays than the one before, until the time ends; the last whole one
/// stands. The first is drawn in any case.
AccuratePicture draw_in_time(Drawer& drawer, DrawOptions& options, double seconds, Frame& frame) {
  using std::chrono::duration;
  const FrameSize& size = drawer.size;
  const std::size_t memory_bytes = options.cells.memory_bytes;
  // An image that is being made at the end is made to its end.
  constexpr double drawing_fraction = 0.97;
  const auto end = Clock::now() +
                   std::chrono::duration_cast<Clock::duration>(duration<double>(drawing_fraction * seconds));
  AccuratePicture picture;
  auto images = Wave::Images::moving;
  for (std::optional<Wave> wave = first_wave(size); wave;) {
    FrameSize wave_size = size;
    wave_size.width = (size.width + wave->magnification - 1) / wave->magnification;
    wave_size.height = (size.height + wave->magnification - 1) / wave->magnification;
    wave_size.supersample = wave->supersample;
    wave_size.band_rows = wave->supersample > 1 ? drawer.band_rows(wave->supersample) : 0;
    DrawOptions wave_options = options;
    if (wave->images == Wave::Images::moving) wave_options.cells = moving_cell_images;
    if (wave->images == Wave::Images::quick) wave_options.cells = quick_cell_images;
    if (wave->images == Wave::Images::rest)
      wave_options.cells.samples_per_pixel_side = image_samples(wave->supersample);
    wave_options.cells.memory_bytes = memory_bytes;
    const Stopwatch watch;
    std::vector<Frame> drawn;
    const RenderStats stats = drawer.draw(wave_size, wave_options, drawer.tints, drawn);
    if (wave_options.is_interrupted()) break;
    const double taken = watch.seconds();
    frame = wave->magnification > 1 ? magnify(drawn[0], size) : std::move(drawn[0]);
    picture.supersample = wave->supersample;
    picture.magnification = wave->magnification;
    images = wave->images;
    drawer.keep(stats);
    options.deadline = end;
    wave = next_wave(*wave, taken, duration<double>(end - Clock::now()).count(), drawer.limit());
  }
  // Quick images are some 10 dB better than moving ones, and a sweater's blocks take 0.07 CPU s.
  if (images == Wave::Images::moving) {
    options.cells = quick_cell_images;
    options.cells.memory_bytes = memory_bytes;
  }
  options.deadline =
      end + std::chrono::duration_cast<Clock::duration>(duration<double>(0.1 * seconds + 0.15));
  picture.accuracy_db = accuracy_of(frame, picture.supersample, drawer).value_or(0);
  return picture;
}

}  // namespace

void accumulate(const RenderStats& one, RenderStats& sum) {
  for (const auto& [name, seconds] : render_seconds) sum.*seconds += one.*seconds;
  sum.prepare_seconds = one.prepare_seconds;
  sum.triangles = one.triangles;
  sum += one;
  sum.peak_image_bytes = std::max(sum.peak_image_bytes, one.peak_image_bytes);
  if (one.remarks.size() >= sum.remarks.size()) sum.remarks = one.remarks;
}

double frame_psnr_db(const Frame& a, const Frame& b, const DisplayOptions& display) {
  double square = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    square += square_error(a.pixels[i], b.pixels[i], over_white(display));
  return decibels(square / (3.0 * static_cast<double>(a.pixels.size())));
}

Result<AccuratePicture> draw_for_goal(Renderer& renderer, const PictureGoal& goal, const FrameSize& size,
                                      const Camera& camera, DrawOptions options, Frame& frame,
                                      RenderStats& stats) {
  std::vector<Frame> frames;
  auto pictures = draw_for_goal(renderer, goal, size, camera, std::move(options), {&renderer.own_tints(), 1},
                                frames, stats);
  if (!pictures) return tl::unexpected(pictures.error());
  frame = std::move(frames[0]);
  return (*pictures)[0];
}

Result<std::vector<AccuratePicture>> draw_for_goal(Renderer& renderer, const PictureGoal& goal,
                                                   const FrameSize& size, const Camera& camera,
                                                   DrawOptions options, std::span<const Tints> tints,
                                                   std::vector<Frame>& frames, RenderStats& stats) {
  return catch_failure([&] {
    stats = {};
    Drawer drawer{renderer, size, camera, options, over_white(goal.display), tints, stats};
    std::vector<AccuratePicture> pictures(tints.size(), {size.supersample});
    frames.resize(tints.size());
    if (goal.seconds)
      pictures[0] = draw_in_time(drawer, options, *goal.seconds, frames[0]);
    else if (goal.accuracy_db)
      pictures = draw_accurate(drawer, *goal.accuracy_db, frames);
    else
      drawer.draw({size.supersample}, nullptr, tints, frames);
    FrameSize left = size;
    left.supersample = pictures[0].supersample;
    left.band_rows = drawer.band_rows(left.supersample);
    value_or_throw(renderer.resize(left));
    return pictures;
  });
}

}  // namespace selvedge
