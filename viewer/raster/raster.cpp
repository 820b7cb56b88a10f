#include "viewer/raster/raster.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "format/base/parallel.h"
#include "format/simd/wide_float.h"

namespace selvedge {
namespace {

constexpr std::size_t triangles_per_task = 1024;
constexpr std::size_t max_lanes = 16;
constexpr double rounding = 1e-6;  ///< of rows; edges decide

/// Pixels of a row that a triangle covers.
struct Span {
  std::size_t begin = 0;  ///< of the row's first pixel in the buffers
  int first = 0, last = -1;
  float depth = 0;  ///< at pixel `first`
  float depth_x = 0;
  std::int32_t surface = 0;
};

template <std::size_t N>
SELVEDGE_INLINE void draw_spans(const Span* spans, std::size_t count, RasterRows& to) {
  using Wide = WideFloat<N>;
  using Ints = typename Lanes<N>::Ints;
  const Wide one(1);
  Wide lanes;
  for (std::size_t k = 0; k < N; ++k) lanes.v[k] = static_cast<float>(k);
  for (const Span* span = spans; span != spans + count; ++span) {
    const Wide slope(span->depth_x);
    for (int x = span->first; x <= span->last; x += static_cast<int>(N)) {
      const std::size_t at = span->begin + x;
      Wide depth = Wide(span->depth) + slope * (lanes + Wide(static_cast<float>(x - span->first)));
      depth = if_greater(Wide(static_cast<float>(span->last - x) + 0.5F), lanes, depth, one);
      // Clipped as by OpenGL.
      depth = if_greater(Wide(0), depth, one, depth);
      const Wide known = Wide::load(&to.depth[at]);
      Ints surface;
      Ints number;
      std::memcpy(&surface, &to.surface[at], sizeof surface);
      std::memcpy(&number, &to.count[at], sizeof number);
      surface = known.v > depth.v ? Ints{} + span->surface : surface;
      number = one.v > depth.v ? number + 1 : number;
      min(depth, known).store(&to.depth[at]);
      std::memcpy(&to.surface[at], &surface, sizeof surface);
      std::memcpy(&to.count[at], &number, sizeof number);
    }
  }
}
SELVEDGE_THREE_BODIES(draw_spans, (const Span* spans, std::size_t count, RasterRows& to), (spans, count, to))

template <std::size_t N>
SELVEDGE_INLINE void merge_lanes(const std::array<RasterRows, 2>& sides, std::size_t from,
                                 std::span<TriangleSide> nearest, std::span<TriangleSide> behind) {
  using Ints = typename Lanes<N>::Ints;
  const auto load = [](const std::int32_t* values) {
    Ints result;
    std::memcpy(&result, values, sizeof result);
    return result;
  };
  for (std::size_t x = 0; x < nearest.size(); x += N) {
    const std::size_t i = from + x;
    const WideFloat<N> front = WideFloat<N>::load(&sides[0].depth[i]);
    const WideFloat<N> back = WideFloat<N>::load(&sides[1].depth[i]);
    const Ints front_surface = load(&sides[0].surface[i]);
    const Ints back_surface = load(&sides[1].surface[i]);
    const Ints front_count = load(&sides[0].count[i]);
    const Ints back_count = load(&sides[1].count[i]);
    const Ints none = Ints{} + static_cast<std::int32_t>(no_triangle_side);
    const Ints count = front_count + back_count;
    Ints first = front.v > back.v ? back_surface : front_surface;
    Ints second = front.v > back.v ? front_surface : back_surface;
    first = count > 0 ? first : none;
    second = count > 1 ? second : none;
    const Ints most = front_count > back_count ? front_count : back_count;
    second = most > 1 ? Ints{} + static_cast<std::int32_t>(deep_triangle_side) : second;
    const std::size_t size = std::min(N, nearest.size() - x) * sizeof(TriangleSide);
    std::memcpy(&nearest[x], &first, size);
    std::memcpy(&behind[x], &second, size);
  }
}
SELVEDGE_THREE_BODIES(merge_lanes,
                      (const std::array<RasterRows, 2>& sides, std::size_t from,
                       std::span<TriangleSide> nearest, std::span<TriangleSide> behind),
                      (sides, from, nearest, behind))

}  // namespace

void merge_sides(const std::array<RasterRows, 2>& sides, std::size_t from, std::span<TriangleSide> nearest,
                 std::span<TriangleSide> behind) {
  merge_lanes_for_this_processor(sides, from, nearest, behind);
}

Raster::Triangle Raster::set_up(const MergedSurfaces& mesh, const ProjectedVertices& projected,
                                TriangleSide surface) {
  const MergedTriangle& triangle = mesh.triangles[surface / 2];
  Triangle result;
  result.surface = surface;
  // (x w, y w, w), from the centre of the first pixel.
  std::array<V3d, 3> p;
  double low = HUGE_VAL;
  double high = -HUGE_VAL;
  double left = HUGE_VAL;
  double right = -HUGE_VAL;
  bool before_viewer = true;
  for (std::size_t k = 0; k < 3; ++k) {
    const Group& at = projected.screen[triangle.corners[k]];
    const auto w = static_cast<double>(at[2]);
    p[k] = {static_cast<double>(at[0]) + 0.5 * (projected.width - 1) * w,
            static_cast<double>(at[1]) + 0.5 * (projected.height - 1) * w, w};
    before_viewer &= w > 0;
    low = std::min(low, p[k].y / w);
    high = std::max(high, p[k].y / w);
    left = std::min(left, p[k].x / w);
    right = std::max(right, p[k].x / w);
  }
  const double sign = surface % 2 == 0 ? 1 : -1;
  V3d depth(0, 0, 0);
  double det = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const V3d e = p[(k + 1) % 3].cross(p[(k + 2) % 3]);
    depth += e * static_cast<double>(projected.clip[triangle.corners[k]].z);
    if (k == 0) det = e.dot(p[0]);
    result.edges[k] = {sign * e.x, sign * e.y, sign * e.z, e.x == 0 ? 0 : -sign / e.x};
  }
  const double scale = det != 0 ? 0.5 / det : 0;
  for (int k = 0; k < 3; ++k) result.depth[k] = depth[k] * scale;
  result.depth[2] += 0.5;
  const auto column_of = [&](double x) {
    return static_cast<int>(64 * std::max(0.0, std::min(x, projected.width - 1.0)) / projected.width);
  };
  result.columns = ~std::uint64_t{0};
  if (before_viewer)
    result.columns = result.columns << column_of(left - 1) & result.columns >> (63 - column_of(right + 1));
  const double top = projected.height;
  result.low = static_cast<int>(before_viewer ? std::clamp(std::ceil(low - rounding), 0.0, top) : 0);
  result.high =
      static_cast<int>(before_viewer ? std::clamp(std::floor(high + rounding), -1.0, top - 1) : top - 1);
  return result;
}

void Raster::begin(const MergedSurfaces& mesh, const ProjectedVertices& projected,
                   std::span<const std::uint32_t> list, bool back, int first_row, int rows) {
  width_ = projected.width;
  first_row_ = first_row;
  rows_ = rows;
  triangles_.resize(list.size());
  parallel_each(list.size(), triangles_per_task, [&](std::size_t i) {
    Triangle& t = triangles_[i];
    t = set_up(mesh, projected, 2 * list[i] + (back ? 1 : 0));
    t.low = std::max(t.low - first_row, 0);
    t.high = std::min(t.high - first_row, rows - 1);
  });
  // A counting sort by strips.
  const auto each_strip = [](const Triangle& t, const auto& body) {
    for (int strip = t.low / strip_rows; t.low <= t.high && strip <= t.high / strip_rows; ++strip)
      body(strip);
  };
  strips_.assign((rows + strip_rows - 1) / strip_rows + 1, 0);
  for (const Triangle& t : triangles_) each_strip(t, [&](int strip) { ++strips_[strip + 1]; });
  for (std::size_t i = 1; i < strips_.size(); ++i) strips_[i] += strips_[i - 1];
  listed_.resize(strips_.back());
  std::vector<std::uint32_t> next(strips_.begin(), strips_.end() - 1);
  for (std::uint32_t i = 0; i < triangles_.size(); ++i)
    each_strip(triangles_[i], [&](int strip) { listed_[next[strip]++] = i; });
}

/// visit(triangle, row of the band, first and last pixel) for all rows that triangles of a strip cover and
/// for which wanted(triangle, row) holds.
template <class Wanted, class Visit>
void Raster::each_span(int strip, const Wanted& wanted, const Visit& visit) const {
  const int first = strip * strip_rows;
  const int last_row = std::min(first + strip_rows, rows_) - 1;
  for (std::uint32_t i = strips_[strip]; i < strips_[strip + 1]; ++i) {
    const Triangle& t = triangles_[listed_[i]];
    for (int row = std::max(t.low, first); row <= std::min(t.high, last_row); ++row) {
      if (!wanted(t, row)) continue;
      const double y = first_row_ + row;
      int from = 0;
      int end = width_;
      for (const Edge& edge : t.edges) {
        const double at_row = edge.b * y + edge.c;
        if (edge.inverse == 0) {
          if (!(at_row > 0 || (at_row == 0 && edge.b > 0))) end = 0;
          continue;
        }
        // The first pixel behind the edge, by the sign of the edge's function there: two triangles that share
        // the edge have the same numbers but for the sign, and the pixel goes to one of them.
        const double crossing = std::max(-1.0, std::min(width_ + 1.0, at_row * edge.inverse));
        int x = static_cast<int>(crossing);
        if (x < crossing) ++x;
        const auto is_behind = [&](int pixel) {
          const double value = edge.a * pixel + at_row;
          return edge.a > 0 ? value >= 0 : value <= 0;
        };
        if (is_behind(x - 1))
          --x;
        else if (!is_behind(x))
          ++x;
        if (edge.a > 0)
          from = std::max(from, x);
        else
          end = std::min(end, x);
      }
      const int last = end - 1;
      if (from <= last) visit(t, row, from, last);
    }
  }
}

void Raster::draw(int strip, RasterRows& to) const {
  const int first = strip * strip_rows;
  to.stride = width_ + max_lanes;
  const std::size_t size = to.stride * (std::min(first + strip_rows, rows_) - first);
  to.depth.assign(size, 1);
  to.surface.resize(size);
  to.count.assign(size, 0);
  std::array<Span, 64> spans;
  std::size_t waiting = 0;
  const auto all = [](const Triangle&, int) { return true; };
  each_span(strip, all, [&](const Triangle& t, int row, int from, int last) {
    spans[waiting++] = {to.stride * (row - first),
                        from,
                        last,
                        static_cast<float>(t.depth_at(from, first_row_ + row)),
                        static_cast<float>(t.depth[0]),
                        static_cast<std::int32_t>(t.surface)};
    if (waiting < spans.size()) return;
    draw_spans_for_this_processor(spans.data(), waiting, to);
    waiting = 0;
  });
  draw_spans_for_this_processor(spans.data(), waiting, to);
}

void Raster::find_hits(int strip, std::span<const std::uint32_t> pixels, std::vector<DeepHit>& to) const {
  // The first wanted pixel from every eighth one on.
  constexpr std::uint32_t step = 8;
  const auto first = static_cast<std::uint32_t>(strip * strip_rows * width_);
  std::vector<std::uint32_t> next(strip_rows * static_cast<std::size_t>(width_) / step + 1);
  for (std::uint32_t i = 0, k = 0; i < next.size(); ++i) {
    while (k < pixels.size() && pixels[k] < first + step * i) ++k;
    next[i] = k;
  }
  std::array<std::uint64_t, strip_rows> columns{};
  for (const std::uint32_t pixel : pixels) {
    const int x = static_cast<int>(pixel) % width_;
    columns[static_cast<int>(pixel - first) / width_] |= std::uint64_t{1} << (64 * x / width_);
  }
  const auto may_meet = [&](const Triangle& t, int row) {
    return (t.columns & columns[row - strip * strip_rows]) != 0;
  };
  each_span(strip, may_meet, [&](const Triangle& t, int row, int from, int last) {
    const auto begin = static_cast<std::uint32_t>(row * width_);
    for (std::uint32_t k = next[(begin - first + from) / step];
         k < pixels.size() && pixels[k] <= begin + last; ++k) {
      if (pixels[k] < begin + from) continue;
      const auto depth =
          static_cast<float>(t.depth_at(static_cast<int>(pixels[k] - begin), first_row_ + row));
      if (depth >= 0 && depth < 1) to.push_back({pixels[k], depth, t.surface, k, 0});
    }
  });
}

}  // namespace selvedge
