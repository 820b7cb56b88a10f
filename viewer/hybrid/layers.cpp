#include "viewer/hybrid/layers.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>

#include "format/base/parallel.h"
#include "viewer/cells/cell_pass.h"

namespace selvedge {
namespace {

constexpr int rows_per_task = 16;
/// Pixels of a row that are tested together.
constexpr int square = 4;
constexpr std::size_t deep_pixels_per_task = 1024;

/// Collects sixteen pixels at a time, shades them, and composites them behind the pixels' colours.
class Painter {
 public:
  Painter(const IndexScene& index, const ShadingScene& shading, bool has_pbr, const BandPixels& pixels)
      : index_(index),
        shading_(shading),
        pixels_(pixels),
        rest_(shading.options != nullptr ? shading.options->cells.rest : CellImageOptions().rest),
        has_pbr_(has_pbr) {}

  void add(int x, int y, std::uint32_t triangle, bool back, const PbrPixel& pbr) {
    ++count_;
    if (!index_.cells || !shading_.cells->is_plain(triangle)) {
      add_texels(x, pixels_.first_row + y, triangle, back, pbr);
      return;
    }
    put(cells_, x, pixels_.first_row + y, triangle, back);
    if (cells_.count == lane_count) look_up();
  }

  /// Shades the remaining pixels. A pixel must not be added again before.
  void paint() {
    look_up();
    shade_texels();
  }

  std::int64_t count() const { return count_; }
  /// Whether surfaces behind this one show.
  bool is_open(const V4f& pixel) const { return 1 - pixel.w >= rest_; }

 private:
  /// Pixels that show more than cell images.
  struct Texels {
    PixelTriangles waiting;
    PixelBlock block;
    ShadingScratch scratch;
  };

  static void put(PixelTriangles& to, int x, int y, std::uint32_t triangle, bool back) {
    const std::size_t lane = to.count++;
    to.x[lane] = static_cast<std::uint16_t>(x);
    to.y[lane] = static_cast<std::uint16_t>(y);
    to.triangle[lane] = triangle;
    to.back[lane] = back;
  }

  void add_texels(int x, int row, std::uint32_t triangle, bool back, const PbrPixel& pbr) {
    if (!texels_) texels_ = std::make_unique<Texels>();
    PixelTriangles& waiting = texels_->waiting;
    waiting.has_pbr = has_pbr_;
    put(waiting, x, row, triangle, back);
    if (has_pbr_) waiting.pbr[waiting.count - 1] = pbr;
    if (waiting.count == lane_count) shade_texels();
  }

  V4f& at(int x, int row) { return pixels_.at(x, row - pixels_.first_row); }

  /// Most pixels show their cell image alone.
  void look_up() {
    if (cells_.count == 0) return;
    shading_.cells->look(cells_, seen_);
    for (std::size_t lane = 0; lane < cells_.count; ++lane) {
      const int x = cells_.x[lane];
      const int y = cells_.y[lane];
      const std::uint32_t triangle = cells_.triangle[lane];
      if ((seen_.with_texels >> lane & 1) != 0) {
        add_texels(x, y, triangle, cells_.back[lane], {});
        continue;
      }
      V4f value = seen_.at(lane);
      if (!index_.materials[index_.mesh.triangles[triangle].surface].keeps_opacity && value.w > 0)
        value /= value.w;
      V4f& pixel = at(x, y);
      pixel += value * (1 - pixel.w);
    }
    cells_.count = 0;
  }

  void shade_texels() {
    if (!texels_ || texels_->waiting.count == 0) return;
    PixelBlock& block = texels_->block;
    find_texels(index_, texels_->waiting, block);
    const LaneShading& light = shade(shading_, block, texels_->scratch);
    for (std::size_t lane = 0; lane < block.count; ++lane) {
      V4f& pixel = at(block.x[lane], block.y[lane]);
      pixel += V4f(light.red[lane], light.green[lane], light.blue[lane], light.alpha[lane]) * (1 - pixel.w);
    }
    texels_->waiting.count = 0;
  }

  const IndexScene& index_;
  const ShadingScene& shading_;
  const BandPixels& pixels_;
  float rest_;
  bool has_pbr_;
  PixelTriangles cells_;  ///< pixels that most likely show a cell image alone
  CellShading seen_;
  std::unique_ptr<Texels> texels_;
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
  RowShader(const IndexScene& index, const ShadingScene& shading, CellPass& cells,
            const std::array<DrawnSide, 2>& sides, int layers, const BandPixels& pixels, int first)
      : index_(index),
        cells_(cells),
        sides_(sides),
        layers_(layers),
        pixels_(pixels),
        first_(first),
        end_(std::min(first + rows_per_task, pixels.rows)),
        painter_(index, shading, !sides[0].seen.colours.empty(), pixels) {}

  /// Notes the cell images of the nearest surfaces.
  void see_nearest() {
    for (int y = first_; y < end_; ++y) {
      std::fill_n(&pixels_.at(0, y), pixels_.width, V4f(0, 0, 0, 0));
      if (!index_.cells) continue;
      for_nearest(y, [&](int x, std::size_t i, std::size_t side, float, float) {
        if (const std::uint32_t seen = triangle(side, i); cells_.shows(seen))
          cells_.see(seen, side == 1, x, pixels_.first_row + y);
      });
    }
  }

  /// Shades the nearest surfaces, and notes the cell images of those that show behind them.
  void shade_nearest() {
    for (int y = first_; y < end_; ++y) {
      for_nearest(y, [&](int x, std::size_t i, std::size_t side, float front, float back) {
        painter_.add(x, y, triangle(side, i), side == 1, sides_[side].pbr_at(i));
        if (layers_ == 1) return;
        const std::array<std::uint8_t, 2> counts{front < 1 ? sides_[0].seen.counts[i] : std::uint8_t{0},
                                                 back < 1 ? sides_[1].seen.counts[i] : std::uint8_t{0}};
        if (counts[0] + counts[1] > 1) behind_.push_back({x, y, 1 - side, counts});
      });
    }
    painter_.paint();
    count_.covered = count_.evaluated = painter_.count();
    count_.layers = painter_.count() > 0 ? 1 : 0;
    std::erase_if(behind_, [&](const Behind& b) { return !painter_.is_open(pixels_.at(b.x, b.y)); });
    for (const Behind& b : behind_) {
      const std::size_t i = index_of(b.x, b.y);
      if (b.is_deep()) {
        deep_.push_back({static_cast<std::uint32_t>(i), b.counts});
      } else if (const std::uint32_t seen = triangle(b.side, i); cells_.shows(seen)) {
        cells_.see(seen, b.side == 1, b.x, pixels_.first_row + b.y);
      }
    }
  }

  /// Shades the surfaces of the other side behind the nearest ones.
  void shade_behind() {
    const std::int64_t before = painter_.count();
    for (const Behind& b : behind_) {
      if (b.is_deep()) continue;
      const std::size_t i = index_of(b.x, b.y);
      painter_.add(b.x, b.y, triangle(b.side, i), b.side == 1, sides_[b.side].pbr_at(i));
    }
    painter_.paint();
    count_.evaluated = painter_.count();
    if (painter_.count() > before) count_.layers = 2;
  }

  const LayerCount& count() const { return count_; }
  const std::vector<DeepPixels::Pixel>& deep() const { return deep_; }

 private:
  /// A pixel with surfaces behind its nearest one.
  struct Behind {
    int x, y;
    std::size_t side;                    ///< that is not nearest
    std::array<std::uint8_t, 2> counts;  ///< of both sides
    /// Whether a side covers itself.
    bool is_deep() const { return counts[0] > 1 || counts[1] > 1; }
  };

  std::size_t index_of(int x, int y) const { return static_cast<std::size_t>(y) * pixels_.width + x; }
  std::uint32_t triangle(std::size_t side, std::size_t i) const {
    return sides_[side].list[sides_[side].seen.triangles[i]];
  }

  /// visit(x, index, nearest side, depth of front, depth of back) for the pixels of a row that show
  /// something.
  template <class Visit>
  void for_nearest(int y, const Visit& visit) const {
    const std::size_t row = index_of(0, y);
    const std::array depth{&sides_[0].seen.depth[row], &sides_[1].seen.depth[row]};
    for (int left = 0; left < pixels_.width; left += square) {
      const int right = std::min(left + square, pixels_.width);
      if (right - left == square && are_empty(depth[0] + left) && are_empty(depth[1] + left)) continue;
      for (int x = left; x < right; ++x) {
        const float front = depth[0][x];
        const float back = depth[1][x];
        if (front < 1 || back < 1) visit(x, row + x, back < front ? 1U : 0U, front, back);
      }
    }
  }

  const IndexScene& index_;
  CellPass& cells_;
  const std::array<DrawnSide, 2>& sides_;
  int layers_;
  const BandPixels& pixels_;
  int first_, end_;
  Painter painter_;
  std::vector<Behind> behind_;
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

LayerCount shade_band(const IndexScene& index, const ShadingScene& shading, CellPass& cells,
                      const std::array<DrawnSide, 2>& sides, int layers, const BandPixels& pixels,
                      DeepPixels& deep) {
  const int tasks = (pixels.rows + rows_per_task - 1) / rows_per_task;
  std::vector<std::unique_ptr<RowShader>> rows(tasks);
  parallel_for(0, tasks, [&](int task) {
    rows[task] =
        std::make_unique<RowShader>(index, shading, cells, sides, layers, pixels, task * rows_per_task);
    rows[task]->see_nearest();
  });
  if (shading.ends()) return {};
  cells.make();
  parallel_for(0, tasks, [&](int task) { rows[task]->shade_nearest(); });
  if (shading.ends()) return {};
  cells.make(true);
  parallel_for(0, tasks, [&](int task) { rows[task]->shade_behind(); });
  LayerCount sum;
  for (const auto& part : rows) {
    sum += part->count();
    deep.add(part->deep());
  }
  return sum;
}

LayerCount shade_deep(const IndexScene& index, const ShadingScene& shading, CellPass& cells,
                      const DeepPixels& deep, int layers, const BandPixels& pixels) {
  const DeepLayers layered = deep.sorted();
  const std::size_t count = layered.pixels();
  const std::size_t tasks = (count + deep_pixels_per_task - 1) / deep_pixels_per_task;
  std::vector<LayerCount> counts(tasks);
  const auto x_of = [&](std::uint32_t pixel) {
    return static_cast<int>(pixel % static_cast<std::uint32_t>(pixels.width));
  };
  const auto y_of = [&](std::uint32_t pixel) {
    return static_cast<int>(pixel / static_cast<std::uint32_t>(pixels.width));
  };
  for (const DeepHit& hit : layered.hits) {
    if (cells.shows(hit.triangle))
      cells.see(hit.triangle, hit.back, x_of(hit.pixel), pixels.first_row + y_of(hit.pixel));
  }
  cells.make(true);
  parallel_for(0, static_cast<int>(tasks), [&](int task) {
    if (shading.ends()) return;
    const std::size_t first = task * deep_pixels_per_task;
    const std::size_t end = std::min(first + deep_pixels_per_task, count);
    LayerCount& count_of_task = counts[task];
    Painter painter(index, shading, true, pixels);
    // Layer by layer, since a pixel must be composited before it is tested for being opaque. The first is
    // there.
    for (int layer = 1; layer < layers; ++layer) {
      const std::int64_t before = painter.count();
      for (std::size_t k = first; k < end; ++k) {
        if (layered.starts[k] + layer >= layered.starts[k + 1]) continue;
        const DeepHit& hit = layered.hits[layered.starts[k] + layer];
        const int x = x_of(hit.pixel);
        const int y = y_of(hit.pixel);
        if (painter.is_open(pixels.at(x, y))) painter.add(x, y, hit.triangle, hit.back, hit.pbr);
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
