#include "viewer/layers.h"

#include <algorithm>

#include "format/parallel.h"

namespace selvedge {
namespace {

/// What is left to be seen when a pixel counts as opaque: less than half a step of an 8-bit picture.
constexpr float opaque_rest = 0.5F / 255;

/// Rows that one task shades.
constexpr int rows_per_task = 4;
constexpr std::size_t deep_pixels_per_task = 1024;

bool is_open(const V4f& pixel) { return !(1 - pixel.w < opaque_rest); }

/// Lays what comes in sixteens behind what the pixels have.
class Painter {
 public:
  Painter(const IndexScene& index, const ShadingScene& shading, bool has_core, const BandPixels& pixels)
      : index_(index), shading_(shading), pixels_(pixels) {
    waiting_.has_core = has_core;
  }

  /// body(x, y) is called for every pixel that has been painted; it must not add to this painter.
  template <class Body>
  void add(int x, int y, std::uint32_t triangle, bool back, const CorePixel& core, const Body& body) {
    const std::size_t lane = waiting_.count++;
    waiting_.x[lane] = static_cast<std::uint16_t>(x);
    waiting_.y[lane] = static_cast<std::uint16_t>(pixels_.first_row + y);
    waiting_.triangle[lane] = triangle;
    waiting_.back[lane] = back;
    if (waiting_.has_core) waiting_.core[lane] = core;
    if (waiting_.count == lane_count) paint(body);
  }

  template <class Body>
  void paint(const Body& body) {
    if (waiting_.count == 0) return;
    find_texels(index_, waiting_, block_);
    const LaneShading shading = shade(shading_, block_, scratch_);
    for (std::size_t lane = 0; lane < waiting_.count; ++lane) {
      V4f& pixel = pixels_.at(waiting_.x[lane], waiting_.y[lane] - pixels_.first_row);
      pixel += V4f(shading.red[lane], shading.green[lane], shading.blue[lane], shading.alpha[lane]) *
               (1 - pixel.w);
    }
    count_ += static_cast<std::int64_t>(waiting_.count);
    for (std::size_t lane = 0; lane < waiting_.count; ++lane)
      body(static_cast<int>(waiting_.x[lane]), waiting_.y[lane] - pixels_.first_row);
    waiting_.count = 0;
  }

  std::int64_t count() const { return count_; }

 private:
  const IndexScene& index_;
  const ShadingScene& shading_;
  const BandPixels& pixels_;
  PixelTriangles waiting_;
  PixelBlock block_;
  ShadingScratch scratch_;
  std::int64_t count_ = 0;
};

constexpr std::size_t triangles_per_task = 1024;

/// hit(pixel of the band, depth) for every wanted pixel whose centre the triangle covers.
template <class Hit>
void each_pixel_of(const MergedTriangle& triangle, const ProjectedVertices& projected, const BandPixels& band,
                   const std::vector<std::uint8_t>& wanted, const Hit& hit) {
  std::array<V3d, 3> corner;
  std::array<double, 3> z{};
  V2d low(0, 0);
  V2d high(band.width, projected.height);
  bool bounded = true;
  for (std::size_t k = 0; k < 3; ++k) {
    const Group& at = projected.screen[triangle.corners[k]];
    // From the frame's lower left corner.
    const auto w = static_cast<double>(at[2]);
    corner[k] = V3d(static_cast<double>(at[0]) + 0.5 * projected.width * w,
                    static_cast<double>(at[1]) + 0.5 * projected.height * w, w);
    z[k] = static_cast<double>(projected.clip[triangle.corners[k]].z);
    bounded &= w > 0;
  }
  if (bounded) {
    const auto x = [&](std::size_t k) { return corner[k].x / corner[k].z; };
    const auto y = [&](std::size_t k) { return corner[k].y / corner[k].z; };
    low = V2d(std::max(low.x, std::min({x(0), x(1), x(2)})), std::max(low.y, std::min({y(0), y(1), y(2)})));
    high =
        V2d(std::min(high.x, std::max({x(0), x(1), x(2)})), std::min(high.y, std::max({y(0), y(1), y(2)})));
  }
  if (!(low.x <= high.x && low.y <= high.y)) return;
  const int bottom = std::max(static_cast<int>(low.y), band.first_row);
  const int top = std::min(static_cast<int>(high.y), band.first_row + band.rows - 1);
  const int right = std::min(static_cast<int>(high.x), band.width - 1);
  for (int y = bottom; y <= top; ++y) {
    for (int x = static_cast<int>(low.x); x <= right; ++x) {
      const std::size_t pixel =
          static_cast<std::size_t>(y - band.first_row) * static_cast<std::size_t>(band.width) +
          static_cast<std::size_t>(x);
      if (wanted[pixel] == 0) continue;
      std::array<V2d, 3> d;
      for (std::size_t k = 0; k < 3; ++k)
        d[k] = V2d(corner[k].x - (x + 0.5) * corner[k].z, corner[k].y - (y + 0.5) * corner[k].z);
      // Two triangles that share an edge get numbers of opposite sign; 0 counts for one of them.
      std::array<double, 3> e{};
      double sum = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const V2d& a = d[(k + 1) % 3];
        const V2d& b = d[(k + 2) % 3];
        e[k] = a.x * b.y - a.y * b.x;
        sum += e[k];
      }
      bool inside = sum != 0;
      for (std::size_t k = 0; k < 3 && inside; ++k) {
        const V3d& a = corner[(k + 1) % 3];
        const V3d& b = corner[(k + 2) % 3];
        const V2d along(b.x * a.z - a.x * b.z, b.y * a.z - a.y * b.z);
        const bool owns = along.y > 0 || (along.y == 0 && along.x > 0);
        inside = sum > 0 ? e[k] > 0 || (e[k] == 0 && owns) : e[k] < 0 || (e[k] == 0 && owns);
      }
      if (!inside) continue;
      const double depth = (e[0] * z[0] + e[1] * z[1] + e[2] * z[2]) /
                           (e[0] * corner[0].z + e[1] * corner[1].z + e[2] * corner[2].z);
      // As OpenGL clips.
      if (depth >= -1 && depth < 1) hit(static_cast<std::uint32_t>(pixel), static_cast<float>(depth));
    }
  }
}

CorePixel core_at(const DrawnSide& side, std::size_t i) {
  return side.seen.colours.empty() ? CorePixel{} : CorePixel{side.seen.colours[i], side.seen.core[i]};
}

/// Some rows of a band: what one task does.
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
    for (int y = first; y < end; ++y) {
      std::fill_n(&pixels_.at(0, y), pixels_.width, V4f(0, 0, 0, 0));
      for (int x = 0; x < pixels_.width; ++x) look_at(x, y);
    }
    near_.paint([this](int x, int y) { show_second(x, y); });
    far_.paint([](int, int) {});
    count_.evaluated = near_.count() + far_.count();
    if (near_.count() > 0) count_.layers = far_.count() > 0 ? 2 : 1;
  }
  const LayerCount& count() const { return count_; }
  const std::vector<DeepPixels::Pixel>& deep() const { return deep_; }

 private:
  std::size_t index_of(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(pixels_.width) +
           static_cast<std::size_t>(x);
  }
  std::uint32_t triangle(std::size_t side, std::size_t i) const {
    return sides_[side].list[sides_[side].seen.triangles[i]];
  }
  bool sees(std::size_t side, std::size_t i) const { return sides_[side].seen.depth[i] < 1; }
  /// The side that is nearer, of a pixel in which there is something.
  std::size_t nearer(std::size_t i) const {
    if (!sees(0, i)) return 1;
    return sees(1, i) && sides_[1].seen.depth[i] < sides_[0].seen.depth[i] ? 1 : 0;
  }

  void look_at(int x, int y) {
    const std::size_t i = index_of(x, y);
    if (!sees(0, i) && !sees(1, i)) return;
    ++count_.covered;
    const std::size_t side = nearer(i);
    const std::uint32_t seen = triangle(side, i);
    const std::array<std::uint8_t, 2> counts{sees(0, i) ? sides_[0].seen.counts[i] : std::uint8_t{0},
                                             sees(1, i) ? sides_[1].seen.counts[i] : std::uint8_t{0}};
    if (layers_ > 1 && (counts[0] > 1 || counts[1] > 1) &&
        index_.looks[index_.mesh.triangles[seen].surface].keeps_opacity) {
      deep_.push_back({static_cast<std::uint32_t>(i), counts});
      return;
    }
    near_.add(x, y, seen, side == 1, core_at(sides_[side], i), [this](int a, int b) { show_second(a, b); });
  }

  void show_second(int x, int y) {
    const std::size_t i = index_of(x, y);
    if (layers_ == 1 || !sees(0, i) || !sees(1, i) || !is_open(pixels_.at(x, y))) return;
    const std::size_t side = 1 - nearer(i);
    far_.add(x, y, triangle(side, i), side == 1, core_at(sides_[side], i), [](int, int) {});
  }

  const IndexScene& index_;
  const std::array<DrawnSide, 2>& sides_;
  int layers_;
  const BandPixels& pixels_;
  Painter near_;
  Painter far_;
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

bool DeepPixels::has_more(int side, int round) const {
  const auto s = static_cast<std::size_t>(side);
  return std::any_of(pixels_.begin(), pixels_.end(), [&](const Pixel& p) { return p.counts[s] > round; });
}

std::vector<std::uint8_t> DeepPixels::tiles(int width, int rows, int side, int round) const {
  const auto s = static_cast<std::size_t>(side);
  const auto w = static_cast<std::size_t>(width);
  const std::size_t columns = (w + tile_side - 1) / tile_side;
  std::vector<std::uint8_t> result(columns * ((static_cast<std::size_t>(rows) + tile_side - 1) / tile_side));
  for (const Pixel& p : pixels_) {
    if (p.counts[s] > round) result[p.pixel / w / tile_side * columns + p.pixel % w / tile_side] = 1;
  }
  return result;
}

void DeepPixels::take(int side, int round, const DrawnSide& drawn) {
  const auto s = static_cast<std::size_t>(side);
  for (const Pixel& p : pixels_) {
    const float depth = drawn.seen.depth[p.pixel];
    if (p.counts[s] <= round || !(depth < 1)) continue;
    const std::uint32_t triangle = drawn.list[drawn.seen.triangles[p.pixel]];
    hits_.push_back({p.pixel, depth, triangle, side == 1, core_at(drawn, p.pixel)});
  }
}

void DeepPixels::cast(const MergedSurfaces& mesh, const ProjectedVertices& projected,
                      const std::array<DrawnSide, 2>& sides, const BandPixels& band) {
  std::vector<std::uint8_t> wanted(static_cast<std::size_t>(band.width) *
                                   static_cast<std::size_t>(band.rows));
  for (const Pixel& p : pixels_) wanted[p.pixel] = 1;
  for (std::size_t side = 0; side < 2; ++side) {
    const std::vector<std::uint32_t>& list = sides[side].list;
    const std::size_t tasks = (list.size() + triangles_per_task - 1) / triangles_per_task;
    std::vector<std::vector<DeepHit>> found(tasks);
    parallel_for(0, static_cast<int>(tasks), [&](int task) {
      const std::size_t first = static_cast<std::size_t>(task) * triangles_per_task;
      const std::size_t end = std::min(first + triangles_per_task, list.size());
      for (std::size_t i = first; i < end; ++i) {
        const auto hit = [&](std::uint32_t pixel, float depth) {
          found[static_cast<std::size_t>(task)].push_back({pixel, depth, list[i], side == 1, CorePixel{}});
        };
        each_pixel_of(mesh.triangles[list[i]], projected, band, wanted, hit);
      }
    });
    for (const std::vector<DeepHit>& part : found) hits_.insert(hits_.end(), part.begin(), part.end());
  }
}

std::vector<DeepHit> DeepPixels::sorted() const {
  std::vector<DeepHit> hits = hits_;
  std::sort(hits.begin(), hits.end(), [](const DeepHit& a, const DeepHit& b) {
    if (a.pixel != b.pixel) return a.pixel < b.pixel;
    if (a.depth != b.depth) return a.depth < b.depth;
    return a.back != b.back ? b.back : a.triangle < b.triangle;
  });
  return hits;
}

LayerCount shade_band(const IndexScene& index, const ShadingScene& shading,
                      const std::array<DrawnSide, 2>& sides, int layers, const BandPixels& pixels,
                      DeepPixels& deep) {
  const int tasks = (pixels.rows + rows_per_task - 1) / rows_per_task;
  std::vector<LayerCount> counts(static_cast<std::size_t>(tasks));
  std::vector<std::vector<DeepPixels::Pixel>> found(static_cast<std::size_t>(tasks));
  parallel_for(0, tasks, [&](int task) {
    RowShader rows(index, shading, sides, layers, pixels);
    rows.shade(task * rows_per_task, std::min((task + 1) * rows_per_task, pixels.rows));
    counts[static_cast<std::size_t>(task)] = rows.count();
    found[static_cast<std::size_t>(task)] = rows.deep();
  });
  LayerCount sum;
  for (const LayerCount& count : counts) sum += count;
  for (const auto& part : found) deep.add(part);
  return sum;
}

LayerCount shade_deep(const IndexScene& index, const ShadingScene& shading, const DeepPixels& deep,
                      int layers, const BandPixels& pixels) {
  const std::vector<DeepHit> hits = deep.sorted();
  std::vector<std::size_t> starts;  // of the pixels among the hits
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (i == 0 || hits[i].pixel != hits[i - 1].pixel) starts.push_back(i);
  }
  const std::size_t count = starts.size();
  starts.push_back(hits.size());
  const std::size_t tasks = (count + deep_pixels_per_task - 1) / deep_pixels_per_task;
  std::vector<LayerCount> counts(tasks);
  parallel_for(0, static_cast<int>(tasks), [&](int task) {
    const std::size_t first = static_cast<std::size_t>(task) * deep_pixels_per_task;
    const std::size_t end = std::min(first + deep_pixels_per_task, count);
    LayerCount& of = counts[static_cast<std::size_t>(task)];
    Painter painter(index, shading, true, pixels);
    const auto nothing = [](int, int) {};
    // Layer by layer: a pixel must have been painted before it is asked whether it is still open.
    for (std::size_t layer = 0; layer < static_cast<std::size_t>(layers); ++layer) {
      const std::int64_t before = painter.count();
      for (std::size_t k = first; k < end; ++k) {
        if (starts[k] + layer >= starts[k + 1]) continue;
        const DeepHit& hit = hits[starts[k] + layer];
        const auto x = static_cast<int>(hit.pixel % static_cast<std::uint32_t>(pixels.width));
        const auto y = static_cast<int>(hit.pixel / static_cast<std::uint32_t>(pixels.width));
        if (is_open(pixels.at(x, y))) painter.add(x, y, hit.triangle, hit.back, hit.core, nothing);
      }
      painter.paint(nothing);
      if (painter.count() == before) break;
      of.layers = static_cast<int>(layer) + 1;
    }
    of.evaluated = painter.count();
  });
  LayerCount sum;
  for (const LayerCount& part : counts) sum += part;
  return sum;
}

}  // namespace selvedge
