#include "viewer/hybrid/layers.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "format/base/parallel.h"
#include "viewer/hybrid/yarn_points.h"

namespace selvedge {
namespace {

/// A task shades a row of tiles, tile by tile, so that neighbours share the corners of yarn (yarn_points.h).
constexpr int tile_width = 64;
constexpr int rows_per_task = 32;
/// Pixels are shaded in squares of so many a side, whose rays lie close together.
constexpr int square = 4;
static_assert(square * square == lane_count);
constexpr std::size_t deep_pixels_per_task = 1024;

/// Collects sixteen pixels at a time, shades them, and composites them behind the pixels' colours; those that
/// show yarn all together.
class Painter {
 public:
  Painter(const IndexScene& index, const ShadingScene& shading, bool has_pbr, const BandPixels& pixels)
      : index_(index), shading_(shading), pixels_(pixels) {
    waiting_.has_pbr = has_pbr;
  }

  void add(int x, int y, std::uint32_t triangle, bool back, const PbrPixel& pbr) {
    const std::size_t lane = waiting_.count++;
    waiting_.x[lane] = static_cast<std::uint16_t>(x);
    waiting_.y[lane] = static_cast<std::uint16_t>(pixels_.first_row + y);
    waiting_.triangle[lane] = triangle;
    waiting_.back[lane] = back;
    if (waiting_.has_pbr) waiting_.pbr[lane] = pbr;
    if (waiting_.count == lane_count) shade_waiting();
  }

  /// Shades the remaining pixels. A pixel must not be added again before.
  void paint() {
    shade_waiting();
    if (yarn_blocks_ > 0) {
      const auto blocks = std::span(blocks_).first(yarn_blocks_);
      add_yarn(shading_, blocks);
      for (ShadedBlock& block : blocks) composite(block);
    }
    yarn_blocks_ = 0;
  }

  std::int64_t count() const { return count_; }

 private:
  void shade_waiting() {
    if (waiting_.count == 0) return;
    find_texels(index_, waiting_, block_);
    if (blocks_.size() <= yarn_blocks_) blocks_.emplace_back();
    ShadedBlock& block = blocks_[yarn_blocks_];
    shade_texels(shading_, block_, scratch_, block);
    if (block_.shows_yarn) {
      ++yarn_blocks_;
    } else {
      composite(block);
    }
    count_ += static_cast<std::int64_t>(waiting_.count);
    waiting_.count = 0;
  }

  void composite(ShadedBlock& block) {
    finish_light(shading_, block);
    const LaneShading& light = block.light;
    for (std::size_t lane = 0; lane < block.places.count; ++lane) {
      V4f& pixel = pixels_.at(block.places.x[lane], block.places.y[lane] - pixels_.first_row);
      pixel += V4f(light.red[lane], light.green[lane], light.blue[lane], light.alpha[lane]) * (1 - pixel.w);
    }
  }

  const IndexScene& index_;
  const ShadingScene& shading_;
  const BandPixels& pixels_;
  PixelTriangles waiting_;
  PixelBlock block_;
  ShadingScratch scratch_;
  std::vector<ShadedBlock> blocks_;  ///< the first of them wait for their yarn
  std::size_t yarn_blocks_ = 0;
  std::int64_t count_ = 0;
};

/// Whether so many depths of a row, the next of a square, are all 1.
bool are_empty(const float* depth) {
  constexpr auto one = std::bit_cast<std::uint32_t>(1.0F);
  std::array<std::uint32_t, square> bits;
  std::memcpy(bits.data(), depth, sizeof bits);
  std::uint32_t difference = 0;
  for (const std::uint32_t b : bits) difference |= b ^ one;
  return difference == 0;
}

/// Shades some rows of a band, the work of one task.
class RowShader {
 public:
  RowShader(const IndexScene& index, const ShadingScene& shading, const std::array<DrawnSide, 2>& sides,
            int layers, const BandPixels& pixels)
      : index_(index),
        sides_(sides),
        layers_(layers),
        pixels_(pixels),
        near_(index, shading, !sides[0].seen.colours.empty(), pixels),
        far_(index, shading, !sides[0].seen.colours.empty(), pixels) {}

  void shade(int first, int end) {
    for (int y = first; y < end; ++y) std::fill_n(&pixels_.at(0, y), pixels_.width, V4f(0, 0, 0, 0));
    for (int x = 0; x < pixels_.width; x += tile_width)
      shade_tile(x, std::min(x + tile_width, pixels_.width), first, end);
    count_.covered = near_.count() + static_cast<std::int64_t>(deep_.size());
    count_.evaluated = near_.count() + far_.count();
    if (near_.count() > 0) count_.layers = far_.count() > 0 ? 2 : 1;
  }
  const LayerCount& count() const { return count_; }
  const std::vector<DeepPixels::Pixel>& deep() const { return deep_; }

 private:
  /// The surfaces that may show behind a pixel's nearest one.
  struct Second {
    int x, y;
    std::size_t side;
  };

  std::size_t index_of(int x, int y) const { return y * pixels_.width + x; }
  std::uint32_t triangle(std::size_t side, std::size_t i) const {
    return sides_[side].list[sides_[side].seen.triangles[i]];
  }

  void shade_tile(int left, int right, int first, int end) {
    for (int y = first; y < end; y += square) {
      for (int x = left; x < right; x += square)
        show_nearest(x, std::min(x + square, right), y, std::min(y + square, end));
    }
    near_.paint();
    for (const Second& second : seconds_) {
      if (!is_open(pixels_.at(second.x, second.y))) continue;
      const std::size_t i = index_of(second.x, second.y);
      far_.add(second.x, second.y, triangle(second.side, i), second.side == 1, sides_[second.side].pbr_at(i));
    }
    far_.paint();
    seconds_.clear();
  }

  void show_nearest(int left, int right, int first, int end) {
    for (int y = first; y < end; ++y) {
      const std::size_t row = index_of(0, y);
      const std::array depth{&sides_[0].seen.depth[row], &sides_[1].seen.depth[row]};
      if (right - left == square && are_empty(depth[0] + left) && are_empty(depth[1] + left)) continue;
      for (int x = left; x < right; ++x) {
        if (depth[0][x] < 1 || depth[1][x] < 1) look_at(x, y, depth[0][x], depth[1][x]);
      }
    }
  }

  void look_at(int x, int y, float front, float back) {
    const std::size_t i = index_of(x, y);
    const std::size_t side = back < front ? 1 : 0;
    const std::uint32_t seen = triangle(side, i);
    if (layers_ > 1) {
      const std::array<std::uint8_t, 2> counts{front < 1 ? sides_[0].seen.counts[i] : std::uint8_t{0},
                                               back < 1 ? sides_[1].seen.counts[i] : std::uint8_t{0}};
      if ((counts[0] > 1 || counts[1] > 1) &&
          index_.materials[index_.mesh.triangles[seen].surface].keeps_opacity) {
        deep_.push_back({static_cast<std::uint32_t>(i), counts});
        return;
      }
      if (front < 1 && back < 1) seconds_.push_back({x, y, 1 - side});
    }
    near_.add(x, y, seen, side == 1, sides_[side].pbr_at(i));
  }

  const IndexScene& index_;
  const std::array<DrawnSide, 2>& sides_;
  int layers_;
  const BandPixels& pixels_;
  Painter near_;
  Painter far_;
  std::vector<Second> seconds_;
  LayerCount count_;
  std::vector<DeepPixels::Pixel> deep_;
};

}  // namespace

LayerCount& LayerCount::operator+=(const LayerCount& b) {
  covered += b.covered;
  evaluated += b.evaluated;
  layers = std::max(layers, b.layers);
  return *this;
}

LayerCount shade_band(const IndexScene& index, const ShadingScene& shading,
                      const std::array<DrawnSide, 2>& sides, int layers, const BandPixels& pixels,
                      DeepPixels& deep) {
  const int tasks = (pixels.rows + rows_per_task - 1) / rows_per_task;
  std::vector<LayerCount> counts(tasks);
  std::vector<std::vector<DeepPixels::Pixel>> found(tasks);
  parallel_for(0, tasks, [&](int task) {
    if (shading.ends()) return;
    RowShader rows(index, shading, sides, layers, pixels);
    rows.shade(task * rows_per_task, std::min((task + 1) * rows_per_task, pixels.rows));
    counts[task] = rows.count();
    found[task] = rows.deep();
  });
  LayerCount sum;
  for (const LayerCount& count : counts) sum += count;
  for (const auto& part : found) deep.add(part);
  return sum;
}

LayerCount shade_deep(const IndexScene& index, const ShadingScene& shading, const DeepPixels& deep,
                      int layers, const BandPixels& pixels) {
  const DeepLayers layered = deep.sorted();
  const std::size_t count = layered.pixels();
  const std::size_t tasks = (count + deep_pixels_per_task - 1) / deep_pixels_per_task;
  std::vector<LayerCount> counts(tasks);
  parallel_for(0, static_cast<int>(tasks), [&](int task) {
    if (shading.ends()) return;
    const std::size_t first = task * deep_pixels_per_task;
    const std::size_t end = std::min(first + deep_pixels_per_task, count);
    LayerCount& count_of_task = counts[task];
    Painter painter(index, shading, true, pixels);
    // Layer by layer, since a pixel must be composited before it is tested for being opaque.
    for (int layer = 0; layer < layers; ++layer) {
      const std::int64_t before = painter.count();
      for (std::size_t k = first; k < end; ++k) {
        if (layered.starts[k] + layer >= layered.starts[k + 1]) continue;
        const DeepHit& hit = layered.hits[layered.starts[k] + layer];
        const auto x = static_cast<int>(hit.pixel % static_cast<std::uint32_t>(pixels.width));
        const auto y = static_cast<int>(hit.pixel / static_cast<std::uint32_t>(pixels.width));
        if (is_open(pixels.at(x, y))) painter.add(x, y, hit.triangle, hit.back, hit.pbr);
      }
      painter.paint();
      if (painter.count() == before) break;
      count_of_task.layers = layer + 1;
    }
    count_of_task.evaluated = painter.count();
  });
  LayerCount sum;
  for (const LayerCount& part : counts) sum += part;
  return sum;
}

}  // namespace selvedge
