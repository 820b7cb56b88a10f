#include "viewer/hybrid/deep_pixels.h"

#include <algorithm>
#include <bit>
#include <optional>

#include "format/base/parallel.h"

namespace selvedge {
namespace {

constexpr std::size_t triangles_per_task = 1024;
static_assert(tile_side == 8, "a tile's pixels are the bits of a number");

/// The wanted pixels of the frame.
struct WantedPixels {
  int width;
  int first_row;
  int rows;
  int tile_columns;
  std::span<const std::uint64_t> tiles;
};

/// Edge functions of a projected triangle.
class Edges {
 public:
  Edges(const MergedTriangle& triangle, const ProjectedVertices& projected) {
    // (x w, y w, w) from the frame's lower left corner.
    std::array<V3d, 3> corner;
    for (std::size_t k = 0; k < 3; ++k) {
      const Group& at = projected.screen[triangle.corners[k]];
      const auto w = static_cast<double>(at[2]);
      corner[k] = V3d(static_cast<double>(at[0]) + 0.5 * projected.width * w,
                      static_cast<double>(at[1]) + 0.5 * projected.height * w, w);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const V3d& a = corner[(k + 1) % 3];
      const V3d& b = corner[(k + 2) % 3];
      edge_[k] = a.cross(b);
      const V2d along(b.x * a.z - a.x * b.z, b.y * a.z - a.y * b.z);
      owns_[k] = along.y > 0 || (along.y == 0 && along.x > 0);
      z_ += edge_[k] * static_cast<double>(projected.clip[triangle.corners[k]].z);
      w_ += edge_[k] * corner[k].z;
    }
    sign_ = corner[0].dot(edge_[0]) > 0 ? 1 : -1;
  }

  /// The depth at a pixel's centre if the triangle covers it, else 1. Two triangles that share an edge never
  /// cover the same centre: their edge functions differ only in sign, and 0 counts for one of them.
  double depth_at(int x, int y) const {
    const V3d centre(x + 0.5, y + 0.5, 1);
    const std::array<double, 3> e{sign_ * edge_[0].dot(centre), sign_ * edge_[1].dot(centre),
                                  sign_ * edge_[2].dot(centre)};
    // One branch for all three edges, since each alone is unpredictable.
    if (std::min(std::min(e[0], e[1]), e[2]) < 0) return 1;
    for (std::size_t k = 0; k < 3; ++k) {
      if (e[k] == 0 && !owns_[k]) return 1;
    }
    const double depth = z_.dot(centre) / w_.dot(centre);
    // Clipped as by OpenGL.
    return depth >= -1 ? depth : 1;
  }

 private:
  std::array<V3d, 3> edge_;  ///< times (x, y, 1): twice the area of the triangle of pixel and edge, times w's
  std::array<bool, 3> owns_{};
  double sign_ = 1;  ///< negative if the back is visible
  V3d z_{0, 0, 0};   ///< clip space's, weighted as w_
  V3d w_{0, 0, 0};
};

/// Bits low ... high of eight.
std::uint64_t bits_between(int low, int high) { return 0xffU >> (7 - (high - low)) << low; }

/// Calls hit(pixel of the band, depth) for every wanted pixel whose centre the triangle covers.
template <class Hit>
void each_pixel_of(const MergedTriangle& triangle, const ProjectedVertices& projected,
                   const WantedPixels& wanted, const Hit& hit) {
  V2f low(0, static_cast<float>(wanted.first_row));
  V2f high(static_cast<float>(wanted.width - 1), static_cast<float>(wanted.first_row + wanted.rows - 1));
  const auto screen = [&](std::size_t k) -> const Group& { return projected.screen[triangle.corners[k]]; };
  if (screen(0)[2] > 0 && screen(1)[2] > 0 && screen(2)[2] > 0) {
    const V2f middle(0.5F * static_cast<float>(projected.width), 0.5F * static_cast<float>(projected.height));
    const auto place = [&](std::size_t k) { return V2f(screen(k)[0], screen(k)[1]) / screen(k)[2] + middle; };
    const std::array corners{place(0), place(1), place(2)};
    // One extra pixel on each side, since positions are rounded here.
    for (int axis = 0; axis < 2; ++axis) {
      const auto [lowest, highest] = std::minmax({corners[0][axis], corners[1][axis], corners[2][axis]});
      low[axis] = std::max(low[axis], lowest - 1);
      high[axis] = std::min(high[axis], highest + 0.5F);
    }
  }
  if (!(low.x <= high.x && low.y <= high.y)) return;
  const int left = static_cast<int>(low.x);
  const int right = static_cast<int>(high.x);
  const int bottom = static_cast<int>(low.y) - wanted.first_row;
  const int top = static_cast<int>(high.y) - wanted.first_row;
  std::optional<Edges> edges;
  for (int row = bottom / tile_side; row <= top / tile_side; ++row) {
    const int first_y = row * tile_side;
    const std::uint64_t in_rows = ~std::uint64_t{0} << (8 * std::max(bottom - first_y, 0)) &
                                  ~std::uint64_t{0} >> (8 * std::max(first_y + 7 - top, 0));
    for (int column = left / tile_side; column <= right / tile_side; ++column) {
      const int first_x = column * tile_side;
      std::uint64_t bits =
          wanted.tiles[row * wanted.tile_columns + column] & in_rows &
          bits_between(std::max(left - first_x, 0), std::min(right - first_x, 7)) * 0x0101010101010101U;
      if (bits != 0 && !edges) edges.emplace(triangle, projected);
      for (; bits != 0; bits &= bits - 1) {
        const int bit = std::countr_zero(bits);
        const int x = first_x + bit % 8;
        const int y = first_y + bit / 8;
        const double depth = edges->depth_at(x, wanted.first_row + y);
        if (depth < 1) hit(static_cast<std::uint32_t>(y * wanted.width + x), static_cast<float>(depth));
      }
    }
  }
}

}  // namespace

DeepPixels::DeepPixels(int width, int rows)
    : width_(width), rows_(rows), tile_columns_((width + tile_side - 1) / tile_side) {
  tiles_.resize(tile_columns_ * ((rows + tile_side - 1) / tile_side));
}

void DeepPixels::add(std::span<const Pixel> pixels) {
  pixels_.insert(pixels_.end(), pixels.begin(), pixels.end());
  for (const Pixel& p : pixels) {
    const Place at = place_of(p.pixel);
    tiles_[at.tile] |= std::uint64_t{1} << at.bit;
  }
}

DeepPixels::Place DeepPixels::place_of(std::uint32_t pixel) const {
  const std::uint32_t x = pixel % static_cast<std::uint32_t>(width_);
  const std::uint32_t y = pixel / static_cast<std::uint32_t>(width_);
  return {std::size_t{y / 8} * tile_columns_ + x / 8, y % 8 * 8 + x % 8};
}

bool DeepPixels::has_more(int side, int round) const {
  return std::any_of(pixels_.begin(), pixels_.end(), [&](const Pixel& p) { return p.counts[side] > round; });
}

std::vector<std::uint8_t> DeepPixels::tiles(int side, int round) const {
  std::vector<std::uint8_t> result(tiles_.size());
  for (const Pixel& p : pixels_) {
    if (p.counts[side] > round) result[place_of(p.pixel).tile] = 1;
  }
  return result;
}

void DeepPixels::add_round(int side, int round, const DrawnSide& drawn) {
  for (const Pixel& p : pixels_) {
    const float depth = drawn.seen.depth[p.pixel];
    if (p.counts[side] <= round || !(depth < 1)) continue;
    const std::uint32_t triangle = drawn.list[drawn.seen.triangles[p.pixel]];
    hits_.push_back({p.pixel, depth, triangle, side == 1, drawn.pbr_at(p.pixel)});
  }
}

void DeepPixels::cast(const MergedSurfaces& mesh, const ProjectedVertices& projected,
                      const std::array<DrawnSide, 2>& sides, int first_row) {
  const WantedPixels wanted{width_, first_row, rows_, tile_columns_, tiles_};
  for (std::size_t side = 0; side < 2; ++side) {
    const std::vector<std::uint32_t>& list = sides[side].list;
    const std::size_t tasks = (list.size() + triangles_per_task - 1) / triangles_per_task;
    std::vector<std::vector<DeepHit>> found(tasks);
    parallel_for(0, static_cast<int>(tasks), [&](int task) {
      const std::size_t first = task * triangles_per_task;
      const std::size_t end = std::min(first + triangles_per_task, list.size());
      for (std::size_t i = first; i < end; ++i) {
        const auto hit = [&](std::uint32_t pixel, float depth) {
          found[task].push_back({pixel, depth, list[i], side == 1, PbrPixel{}});
        };
        each_pixel_of(mesh.triangles[list[i]], projected, wanted, hit);
      }
    });
    for (const std::vector<DeepHit>& part : found) hits_.insert(hits_.end(), part.begin(), part.end());
  }
}

DeepLayers DeepPixels::sorted() const {
  // A counting sort: the begin of each tile's pixels, then the number of surfaces of each pixel.
  std::vector<std::uint32_t> first(tiles_.size() + 1);
  for (std::size_t i = 0; i < tiles_.size(); ++i)
    first[i + 1] = first[i] + static_cast<std::uint32_t>(std::popcount(tiles_[i]));
  const auto number_of = [&](const DeepHit& hit) {
    const Place at = place_of(hit.pixel);
    const std::uint64_t before = tiles_[at.tile] & ((std::uint64_t{1} << at.bit) - 1);
    return first[at.tile] + static_cast<std::uint32_t>(std::popcount(before));
  };
  DeepLayers result;
  result.starts.assign(std::size_t{first.back()} + 1, 0);
  result.hits.resize(hits_.size());
  for (const DeepHit& hit : hits_) ++result.starts[number_of(hit) + 1];
  for (std::size_t i = 1; i < result.starts.size(); ++i) result.starts[i] += result.starts[i - 1];
  std::vector<std::uint32_t> next(result.starts.begin(), result.starts.end() - 1);
  for (const DeepHit& hit : hits_) result.hits[next[number_of(hit)]++] = hit;
  for (std::size_t i = 0; i < result.pixels(); ++i) {
    std::sort(result.hits.begin() + result.starts[i], result.hits.begin() + result.starts[i + 1],
              [](const DeepHit& a, const DeepHit& b) {
                if (a.depth != b.depth) return a.depth < b.depth;
                return a.back != b.back ? b.back : a.triangle < b.triangle;
              });
  }
  return result;
}

}  // namespace selvedge
