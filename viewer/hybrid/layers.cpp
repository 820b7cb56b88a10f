#include "viewer/hybrid/layers.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <memory>

#include "format/base/parallel.h"
#include "viewer/cells/cell_pass.h"

namespace selvedge {
namespace {

constexpr int rows_per_task = Raster::strip_rows;
constexpr std::size_t deep_pixels_per_task = 1024;

/// Shades pixels, and composites them behind the pixels' colours.
class Painter {
 public:
  Painter(const FrameScene& scene, const BandPixels& pixels) : scene_(scene), pixels_(pixels) {}

  /// Overwrites the next sixteen pixels of a row, or those left of its end. `pbr_at`: of a lane.
  template <class PbrAt>
  void put_row(int x, int y, const TriangleSide* surfaces, const PbrAt& pbr_at) {
    const int count = std::min(static_cast<int>(lane_count), pixels_.width - x);
    std::array<V4f, lane_count> to;
    std::uint32_t others = 0;  // lanes
    std::uint32_t plain = 0;
    std::uint32_t cells = 0;
    const TriangleSide nothing = scene_.cells.empty_triangle_side();
    TriangleSide known = no_triangle_side;
    std::uint32_t known_cell = 0;
    std::uint32_t known_plain = 0;
    for (int lane = 0; lane < count; ++lane) {
      const TriangleSide surface = surfaces[lane];
      if (surface != known) {
        known = surface;
        known_cell = surface != no_triangle_side && scene_.cells.shows(surface) ? 1 : 0;
        known_plain = known_cell != 0 && scene_.cells.is_unmodified(surface) ? 1 : 0;
      }
      const std::uint32_t shows = surface != no_triangle_side ? 1 : 0;
      cells |= known_cell << lane;
      plain |= known_plain << lane;
      others |= (shows & ~known_cell) << lane;
      row_.surface[lane] = known_cell != 0 ? surface : nothing;
    }
    count_ += std::popcount(cells | others);
    if (cells == 0) {
      std::fill_n(to.begin(), count, V4f(0, 0, 0, 0));
    } else {
      std::fill(row_.surface.begin() + count, row_.surface.end(), nothing);
      const V2f first = scene_.cells.offset_from_centre(x, pixels_.first_row + y);
      for (std::size_t lane = 0; lane < lane_count; ++lane) row_.x[lane] = first.x + static_cast<float>(lane);
      row_.y.fill(first.y);
      scene_.cells.sample(row_, seen_);
      std::memcpy(static_cast<void*>(to.data()), seen_.pixels.data(), count * sizeof(V4f));
      for (std::uint32_t left = cells; left != 0; left &= left - 1)
        cloth_ += to[std::countr_zero(left)].w > 0 ? 1 : 0;
      for (std::uint32_t left = seen_.hole_filling_lanes; left != 0; left &= left - 1) {
        const int lane = std::countr_zero(left);
        if (lane < count && to[lane].w > 0) to[lane] /= to[lane].w;
      }
    }
    for (std::uint32_t left = others | (cells & ~plain); left != 0; left &= left - 1) {
      const int lane = std::countr_zero(left);
      const bool is_cell = (cells >> lane & 1) != 0;
      const TriangleSide surface = surfaces[lane];
      const SurfaceLight light =
          is_cell ? apply_material(scene_, surface, x + lane, pixels_.first_row + y, pbr_at(lane), to[lane])
                  : shade(surface, x + lane, y, pbr_at(lane));
      for (std::size_t i = 0; i < pixels_.bottoms.size(); ++i)
        pixels_.at(x + lane, y, i) = light.tinted(tint_of(surface, i));
    }
    const std::uint32_t done = others | (cells & ~plain);
    if (done == 0 && !is_tinted_) {
      std::copy_n(to.begin(), count, &pixels_.at(x, y));
      return;
    }
    for (int lane = 0; lane < count; ++lane) {
      if ((done >> lane & 1) != 0) continue;
      const bool shows = is_tinted_ && (cells >> lane & 1) != 0;
      for (std::size_t i = 0; i < pixels_.bottoms.size(); ++i)
        pixels_.at(x + lane, y, i) =
            shows ? SurfaceLight{to[lane]}.tinted(tint_of(surfaces[lane], i)) : to[lane];
    }
  }

  /// Composites a surface behind a pixel's colour. `transparency`: what is still seen through each quarter of
  /// the pixel. A pixel must not be added again before paint().
  void add(int x, int y, TriangleSide surface, const PbrPixel& pbr, Group& transparency) {
    ++count_;
    if (scene_.cells.shows(surface)) {
      wait(x, y, surface, pbr, transparency, false);
      return;
    }
    const SurfaceLight light = shade(surface, x, y, pbr);
    put_behind(x, y, surface, light, 1 - pixels_.at(x, y).w);
    for (float& part : transparency) part *= 1 - light.reflected.w;
  }

  /// Finds what is seen through the nearest surface, after paint().
  void find_transparency(int x, int y, TriangleSide nearest, Group& transparency) {
    const bool is_sampled = samples_per_pixel_ == parts && scene_.cells.shows(nearest);
    transparency.fill(is_sampled ? 1 : 1 - pixels_.at(x, y).w);
    if (is_sampled) wait(x, y, nearest, {}, transparency, true);
  }

  /// Shades the remaining pixels.
  void paint() {
    if (waiting_ == 0) return;
    constexpr float weight = 1 / static_cast<float>(parts);
    std::fill(row_.surface.begin() + static_cast<std::ptrdiff_t>(samples_per_pixel_ * waiting_),
              row_.surface.end(), scene_.cells.empty_triangle_side());
    parts_.surface = row_.surface;
    scene_.cells.sample(parts_, seen_, &row_);
    for (std::size_t k = 0; k < waiting_; ++k) {
      const auto& [x, y, pbr, transparency, is_nearest] = wait_[k];
      V4f sum(0, 0, 0, 0);
      float left = 0;
      for (std::size_t part = 0; part < parts; ++part) {
        V4f value = seen_.at(samples_per_pixel_ * k + part % samples_per_pixel_);
        if ((seen_.hole_filling_lanes >> (samples_per_pixel_ * k) & 1) != 0 && value.w > 0) value /= value.w;
        float& through = (*transparency)[part];
        sum += value * (through * weight);
        through *= 1 - value.w;
        left += through * weight;
      }
      if (is_nearest) {
        for (std::size_t i = 0; i < pixels_.bottoms.size(); ++i) pixels_.at(x, y, i).w = 1 - left;
        continue;
      }
      cloth_ += sum.w > 0 ? 1 : 0;
      const TriangleSide surface = row_.surface[samples_per_pixel_ * k];
      put_behind(x, y, surface,
                 scene_.cells.is_unmodified(surface)
                     ? SurfaceLight{sum}
                     : apply_material(scene_, surface, x, pixels_.first_row + y, pbr, sum),
                 1);
    }
    waiting_ = 0;
  }

  std::int64_t count() const { return count_; }
  std::int64_t cloth() const { return cloth_; }
  /// Whether surfaces behind this one show.
  bool is_open(const V4f& pixel) const { return 1 - pixel.w >= min_transparency_; }

 private:
  /// The factor on the light of a surface in a picture.
  V3f tint_of(TriangleSide surface, std::size_t picture) const {
    return is_tinted_ ? scene_.view.tints[picture][scene_.prepared.mesh.triangles[surface / 2].surface]
                      : V3f(1, 1, 1);
  }
  void put_behind(int x, int y, TriangleSide surface, const SurfaceLight& light, float fraction) {
    for (std::size_t i = 0; i < pixels_.bottoms.size(); ++i)
      pixels_.at(x, y, i) += light.tinted(tint_of(surface, i)) * fraction;
  }
  /// Looks a pixel's quarters up, once there are enough: where holes of two surfaces lie behind each other,
  /// their means would tell more or less than is seen through both.
  void wait(int x, int y, TriangleSide surface, const PbrPixel& pbr, Group& transparency, bool is_nearest) {
    // Texels are means of pixels, and interpolated: from a quarter of a pixel, they would blur it.
    const float offset = samples_per_pixel_ == 1 ? 0 : 3.0F / 16;
    const V2f place = scene_.cells.offset_from_centre(x, pixels_.first_row + y);
    for (std::size_t part = 0; part < samples_per_pixel_; ++part) {
      const std::size_t lane = samples_per_pixel_ * waiting_ + part;
      row_.surface[lane] = surface;
      row_.x[lane] = place.x;
      row_.y[lane] = place.y;
      parts_.x[lane] = place.x + (part % 2 == 0 ? -offset : offset);
      parts_.y[lane] = place.y + (part < 2 ? -offset : offset);
    }
    wait_[waiting_] = {x, y, pbr, &transparency, is_nearest};
    if (samples_per_pixel_ * ++waiting_ == lane_count) paint();
  }
  /// shade_pixel() of a pixel without a cell image.
  SurfaceLight shade(TriangleSide surface, int x, int y, const PbrPixel& pbr) {
    SurfaceLight light = shade_pixel(scene_, surface, x, pixels_.first_row + y, pbr);
    const MergedTriangle& triangle = scene_.prepared.mesh.triangles[surface / 2];
    cloth_ +=
        scene_.prepared.materials.surfaces[triangle.surface].fabric >= 0 && light.reflected.w > 0 ? 1 : 0;
    return light;
  }

  const FrameScene& scene_;
  const BandPixels& pixels_;
  float min_transparency_ = scene_.view.options.cells.min_transparency;
  bool is_tinted_ = !scene_.view.tints.empty();
  CellPixels row_;
  static constexpr std::size_t parts = 4;
  /// One in a picture that moves, for speed.
  std::size_t samples_per_pixel_ = scene_.view.options.cells.is_moving ? 1 : parts;
  CellPixels parts_;  ///< quarters of pixels, where row_ has the pixels themselves
  struct Waiting {
    int x = 0, y = 0;
    PbrPixel pbr;
    Group* transparency = nullptr;
    bool is_nearest = false;
  };
  std::array<Waiting, lane_count> wait_;
  std::size_t waiting_ = 0;
  CellShading seen_;
  std::int64_t count_ = 0, cloth_ = 0;
};

/// Composites the surfaces behind the nearest ones at deep pixels first ... end - 1. `transparency_at`: of
/// one of them, what its nearest surface leaves.
template <class TransparencyAt>
void paint_layers(Painter& painter, const DeepLayers& deep, std::size_t first, std::size_t end, int layers,
                  const BandPixels& pixels, const TransparencyAt& transparency_at, LayerCount& count) {
  // Layer by layer, since a pixel must be composited before it is tested for being opaque. The first is
  // there.
  for (int layer = 1; layer < layers; ++layer) {
    const std::int64_t before = painter.count();
    for (std::size_t k = first; k < end; ++k) {
      if (deep.starts[k] + layer >= deep.starts[k + 1]) continue;
      const DeepHit& hit = deep.hits[deep.starts[k] + layer];
      const int x = static_cast<int>(hit.pixel) % pixels.width;
      const int y = static_cast<int>(hit.pixel) / pixels.width;
      if (painter.is_open(pixels.at(x, y)))
        painter.add(x, y, hit.surface, deep.pbr_of(hit), transparency_at(k));
    }
    painter.paint();
    if (painter.count() == before) break;
    count.layers = std::max(count.layers, layer + 1);
  }
}

/// Shades some rows of a band, the work of one task.
class RowShader {
 public:
  RowShader(const FrameScene& scene, CellPass& cells, BandSurfaces& surfaces, int layers,
            const BandPixels& pixels, int task)
      : scene_(scene), cells_(cells), surfaces_(surfaces), layers_(layers), pixels_(pixels), task_(task) {}

  /// Finds the nearest surfaces, and the ones of the other side behind them; notes the cell images of the
  /// nearest.
  void see_nearest() {
    thread_local std::array<RasterRows, 2> rows;
    const bool is_drawn =
        blocks_ == nullptr || blocks_->has_drawn_rows((pixels_.first_row + first_) / pixels_.supersample,
                                                      (end_ - 1 - first_) / pixels_.supersample + 1);
    if (surfaces_.is_cpu_raster && is_drawn)
      for (std::size_t side = 0; side < 2; ++side) surfaces_.raster[side].draw(task_, rows[side]);
    for (int y = first_; y < end_; ++y) {
      const std::span nearest(&surfaces_.nearest[index_of(0, y)], static_cast<std::size_t>(pixels_.width));
      const std::span behind(&surfaces_.behind[index_of(0, y)], nearest.size());
      if (!is_drawn) {
        std::ranges::fill(nearest, no_triangle_side);
        std::ranges::fill(behind, no_triangle_side);
        continue;
      }
      if (surfaces_.is_cpu_raster)
        merge_sides(rows, static_cast<std::size_t>(y - first_) * rows[0].stride, nearest, behind);
      else
        merge_drawn(index_of(0, y), nearest, behind);
      if (blocks_ != nullptr) clear_beside(y, nearest, behind);
      TriangleSide known = no_triangle_side;
      for (int x = 0; x < pixels_.width; ++x) note(nearest[x], x, y, known);
    }
  }

  /// Shades the nearest surfaces, and lists the deep pixels of which more shows.
  void shade_nearest() {
    for (int y = first_; y < end_; ++y) {
      for (int x = 0; x < pixels_.width; x += lane_count) {
        painter_.put_row(x, y, &surfaces_.nearest[index_of(x, y)], [&](int lane) {
          const std::size_t i = index_of(x + lane, y);
          return surfaces_.pbr_at(surfaces_.nearest[i], i);
        });
      }
    }
    count_.covered_pixels = count_.evaluated_pixels = painter_.count();
    count_.layers = painter_.count() > 0 ? 1 : 0;
    for (int y = first_; y < end_; ++y) {
      for (int x = 0; x < pixels_.width; ++x) {
        TriangleSide& behind = surfaces_.behind[index_of(x, y)];
        if (behind == no_triangle_side) continue;
        const bool is_deep = behind == deep_triangle_side;
        const bool is_open = layers_ > 1 && painter_.is_open(pixels_.at(x, y));
        if (is_open) {
          transparency_.resize(static_cast<std::size_t>(end_ - first_) * pixels_.width);
          painter_.find_transparency(x, y, surfaces_.nearest[index_of(x, y)],
                                     transparency_at(index_of(x, y)));
        }
        if (is_deep && is_open) deep_.push_back(static_cast<std::uint32_t>(index_of(x, y)));
        if (is_deep || !is_open) behind = no_triangle_side;
      }
    }
    painter_.paint();
  }

  /// Finds all surfaces at deep pixels, and notes the cell images of all that may show behind the nearest.
  void see_behind() {
    TriangleSide known = no_triangle_side;
    for (int y = first_; y < end_; ++y)
      for (int x = 0; x < pixels_.width; ++x) note(surfaces_.behind[index_of(x, y)], x, y, known);
    if (surfaces_.has_pbr() || deep_.empty()) return;
    std::vector<DeepHit> hits;
    for (const Raster& raster : surfaces_.raster) raster.find_hits(task_, deep_, hits);
    layers_of_deep_ = sort_by_pixel(deep_.size(), hits);
    for (std::size_t k = 0; k < layers_of_deep_.pixels(); ++k) {
      for (std::size_t i = layers_of_deep_.starts[k] + 1; i < layers_of_deep_.starts[k + 1]; ++i) {
        const DeepHit& hit = layers_of_deep_.hits[i];
        note(hit.surface, static_cast<int>(hit.pixel) % pixels_.width,
             static_cast<int>(hit.pixel) / pixels_.width, known);
      }
    }
  }

  /// Shades the surfaces behind the nearest ones.
  void shade_behind() {
    const std::int64_t before = painter_.count();
    for (int y = first_; y < end_; ++y) {
      const TriangleSide* const behind = &surfaces_.behind[index_of(0, y)];
      for (int x = 0; x < pixels_.width; ++x) {
        if (behind[x] == no_triangle_side) continue;
        const std::size_t i = index_of(x, y);
        painter_.add(x, y, behind[x], surfaces_.pbr_at(behind[x], i), transparency_at(i));
      }
    }
    painter_.paint();
    if (painter_.count() > before) count_.layers = 2;
    paint_layers(
        painter_, layers_of_deep_, 0, layers_of_deep_.pixels(), layers_, pixels_,
        [&](std::size_t k) -> Group& { return transparency_at(deep_[k]); }, count_);
    count_.evaluated_pixels = painter_.count();
    count_.cloth_pixels = painter_.cloth();
  }

  const LayerCount& count() const { return count_; }
  const std::vector<std::uint32_t>& deep() const { return deep_; }
  Group& transparency_at(std::size_t pixel) { return transparency_[pixel - index_of(0, first_)]; }

 private:
  std::size_t index_of(int x, int y) const { return static_cast<std::size_t>(y) * pixels_.width + x; }

  void clear_beside(int y, std::span<TriangleSide> nearest, std::span<TriangleSide> behind) const {
    const int side = blocks_->block_size * pixels_.supersample;
    const std::uint8_t* const blocks =
        blocks_->is_drawn.data() + std::ptrdiff_t{(pixels_.first_row + y) / side} * blocks_->columns;
    for (int x = 0; x < pixels_.width; ++x)
      if (blocks[x / side] == 0) nearest[x] = behind[x] = no_triangle_side;
  }

  void note(TriangleSide surface, int x, int y, TriangleSide& known) {
    if (surface == known || surface >= deep_triangle_side || !cells_.shows(surface)) return;
    cells_.mark_visible(surface, x, pixels_.first_row + y);
    known = cells_.needs_all_pixels(surface) ? no_triangle_side : surface;
  }

  /// As merge_sides(), of a row that OpenGL has drawn; its first pixel has index `row`.
  void merge_drawn(std::size_t row, std::span<TriangleSide> nearest, std::span<TriangleSide> behind) const {
    const std::array<DrawnSide, 2>& sides = surfaces_.sides;
    for (std::size_t x = 0; x < nearest.size(); ++x) {
      const std::size_t i = row + x;
      const float front = sides[0].depth[i];
      const float back = sides[1].depth[i];
      nearest[x] = behind[x] = no_triangle_side;
      if (!(front < 1 || back < 1)) continue;
      const std::size_t side = back < front ? 1 : 0;
      nearest[x] = sides[side].surface_at(i, side);
      const int in_front = front < 1 ? sides[0].counts[i] : 0;
      const int in_back = back < 1 ? sides[1].counts[i] : 0;
      if (in_front > 1 || in_back > 1)
        behind[x] = deep_triangle_side;
      else if (in_front + in_back > 1)
        behind[x] = sides[1 - side].surface_at(i, 1 - side);
    }
  }

  const FrameScene& scene_;
  CellPass& cells_;
  BandSurfaces& surfaces_;
  int layers_;
  const BandPixels& pixels_;
  int task_;
  int first_ = task_ * rows_per_task, end_ = std::min(first_ + rows_per_task, pixels_.rows);
  const FrameBlocks* blocks_ = scene_.view.options.blocks;
  Painter painter_{scene_, pixels_};
  LayerCount count_;
  std::vector<std::uint32_t> deep_;  ///< pixels, ascending
  std::vector<Group> transparency_;  ///< of the rows' pixels: what is seen through the nearest surface
  DeepLayers layers_of_deep_;
};

}  // namespace

void BandSurfaces::draw_band(const FrameScene& scene, int first_row, int rows) {
  for (std::size_t side = 0; side < 2; ++side)
    raster[side].begin(scene.prepared.mesh, scene.projected, sides[side].triangle_list, side == 1, first_row,
                       rows);
}

LayerCount shade_band(const FrameScene& scene, CellPass& cells, BandSurfaces& surfaces, int layers,
                      const BandPixels& pixels, DeepPixels& deep) {
  const int tasks = (pixels.rows + rows_per_task - 1) / rows_per_task;
  const std::size_t size = static_cast<std::size_t>(pixels.rows) * pixels.width;
  surfaces.nearest.resize(size);
  surfaces.behind.resize(size);
  std::vector<std::unique_ptr<RowShader>> rows(tasks);
  parallel_for(0, tasks, [&](int task) {
    rows[task] = std::make_unique<RowShader>(scene, cells, surfaces, layers, pixels, task);
    rows[task]->see_nearest();
  });
  if (scene.view.options.is_interrupted()) return {};
  cells.render();
  parallel_for(0, tasks, [&](int task) { rows[task]->shade_nearest(); });
  if (scene.view.options.is_interrupted()) return {};
  const bool casts = !surfaces.has_pbr();
  if (casts && !surfaces.is_cpu_raster &&
      std::any_of(rows.begin(), rows.end(), [](const auto& part) { return !part->deep().empty(); }))
    surfaces.draw_band(scene, pixels.first_row, pixels.rows);
  parallel_for(0, tasks, [&](int task) { rows[task]->see_behind(); });
  cells.render(true);
  parallel_for(0, tasks, [&](int task) { rows[task]->shade_behind(); });
  LayerCount sum;
  std::vector<DeepPixels::Pixel> deep_pixels;
  for (const auto& part : rows) {
    sum += part->count();
    if (casts) continue;
    for (const std::uint32_t pixel : part->deep()) {
      const std::array<DrawnSide, 2>& sides = surfaces.sides;
      deep_pixels.push_back(
          {pixel, {sides[0].counts[pixel], sides[1].counts[pixel]}, part->transparency_at(pixel)});
    }
  }
  deep.add_pixels(deep_pixels);
  return sum;
}

LayerCount shade_deep_pixels(const FrameScene& scene, CellPass& cells, DeepPixels& deep, int layers,
                             const BandPixels& pixels) {
  const DeepLayers layered = deep.sorted_layers();
  const std::size_t count = layered.pixels();
  const std::size_t tasks = (count + deep_pixels_per_task - 1) / deep_pixels_per_task;
  std::vector<LayerCount> counts(tasks);
  for (const DeepHit& hit : layered.hits) {
    if (!cells.shows(hit.surface)) continue;
    cells.mark_visible(hit.surface, static_cast<int>(hit.pixel) % pixels.width,
                       pixels.first_row + static_cast<int>(hit.pixel) / pixels.width);
  }
  cells.render(true);
  parallel_for(0, static_cast<int>(tasks), [&](int task) {
    if (scene.view.options.is_interrupted()) return;
    const std::size_t first = task * deep_pixels_per_task;
    Painter painter(scene, pixels);
    paint_layers(
        painter, layered, first, std::min(first + deep_pixels_per_task, count), layers, pixels,
        [&](std::size_t k) -> Group& { return deep.transparency_at(k); }, counts[task]);
    counts[task].evaluated_pixels = painter.count();
    counts[task].cloth_pixels = painter.cloth();
  });
  LayerCount sum;
  for (const LayerCount& part : counts) sum += part;
  return sum;
}

V4f shade_surface(const FrameScene& scene, TriangleSide seen, const V2i& pixel, const PbrPixel& pbr) {
  V4f light(0, 0, 0, 0);
  const BandPixels one{pixel.y, pixel.x + 1, 1, {&light - pixel.x}, 0};
  Painter painter(scene, one);
  painter.put_row(pixel.x, 0, &seen, [&](int) { return pbr; });
  return light;
}

bool DeepPixels::add_depth_layer(int side, int round, const DrawnSide& drawn) {
  bool has_more = false;
  for (std::uint32_t number = 0; number < pixels_.size(); ++number) {
    const Pixel& p = pixels_[number];
    const float depth = drawn.depth[p.index_in_band];
    has_more |= p.counts[side] > round + 1;
    if (p.counts[side] <= round || !(depth < 1)) continue;
    hits_.push_back({p.index_in_band, depth, drawn.surface_at(p.index_in_band, side), number,
                     static_cast<std::uint32_t>(pbr_.size())});
    pbr_.push_back(drawn.pbr_at(p.index_in_band));
  }
  return has_more;
}

DeepLayers DeepPixels::sorted_layers() {
  DeepLayers result = sort_by_pixel(pixels_.size(), hits_);
  result.pbr = std::move(pbr_);
  return result;
}

DeepLayers sort_by_pixel(std::size_t pixels, std::span<const DeepHit> hits) {
  // A counting sort by pixels, of which each has few hits.
  DeepLayers result;
  result.starts.assign(pixels + 1, 0);
  result.hits.resize(hits.size());
  for (const DeepHit& hit : hits) ++result.starts[hit.deep_pixel + 1];
  for (std::size_t i = 1; i < result.starts.size(); ++i) result.starts[i] += result.starts[i - 1];
  std::vector<std::uint32_t> next(result.starts);
  for (const DeepHit& hit : hits) result.hits[next[hit.deep_pixel]++] = hit;
  for (std::size_t i = 0; i < result.pixels(); ++i) {
    std::sort(result.hits.begin() + result.starts[i], result.hits.begin() + result.starts[i + 1],
              [](const DeepHit& a, const DeepHit& b) {
                return a.depth != b.depth ? a.depth < b.depth : a.surface < b.surface;
              });
  }
  return result;
}

}  // namespace selvedge
