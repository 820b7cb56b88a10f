#include "format/cells/splat.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "format/fabric/lifted.h"
#include "format/simd/fetch.h"
#include "format/simd/wide_float.h"

namespace selvedge {
namespace {

/// A piece as a quadric over the texels. At (x, y) texels, g is the ray's distance from the axis, and the ray
/// meets the cylinder where r^2 - g^2 >= 0; depth is z + sqrt(r^2 - g^2), place along the axis w + depth *
/// w_depth. Without the root that place is linear, too: it bounds the texels of a row that the piece
/// reaches.
enum Linear {
  g_at,
  g_x,
  g_y,
  z_at,
  z_x,
  z_y,
  w_at,
  w_x,
  w_y,
  r2,
  r,
  inverse_g_x,
  low_x,
  high_x,
  low_y,
  high_y,
  w_depth,
  low_w,
  high_w,
  inverse_axis_x,
  min_axis,
  max_axis,
  shown,
  linear_count
};

/// Stores the box of N pieces' shadows on the plane along the rays, in texels, without the whole repeats (mm)
/// that it returns.
template <std::size_t N>
SELVEDGE_INLINE std::array<WideFloat<N>, 2> put_box(const YarnPieces& pieces, int base, const V2f& shift,
                                                    const WideFloat<N>& radius, const V2f& period,
                                                    float plane, const SplatView& view, const V2f& texel,
                                                    float (*to)[N]) {
  using Wide = WideFloat<N>;
  const auto number = [&](YarnPieces::Number n) __attribute__((always_inline)) {
    return Wide::load(&pieces.numbers[n][base]);
  };
  const Wide zero(0);
  const Wide half(0.5F);
  const Wide gx = number(YarnPieces::squeeze_x);
  const Wide gy = number(YarnPieces::squeeze_y);
  const Wide gz = number(YarnPieces::squeeze_z);
  // Squeezing along g is at its strongest by 1 - g^2.
  const Wide wide = radius / (Wide(1) - gx * gx - gy * gy - gz * gz);
  const auto put_side = [&](YarnPieces::Number start, YarnPieces::Number along, float moved_by, float slope,
                            float repeat, float size, Linear low, Linear high)
      __attribute__((always_inline)) {
    const Wide first =
        number(start) + Wide(moved_by) - Wide(slope) * (number(YarnPieces::start_z) - Wide(plane));
    const Wide extent = number(along) - Wide(slope) * number(YarnPieces::along_z);
    const Wide reach = wide * Wide(std::sqrt(1 + slope * slope));
    const Wide start_of_box = first + min(extent, zero) - reach;
    const Wide moved = floor(start_of_box * Wide(1 / repeat)) * Wide(repeat);
    ((start_of_box - moved) * Wide(1 / size) - half).store(to[low]);
    ((first + max(extent, zero) + reach - moved) * Wide(1 / size) - half).store(to[high]);
    return moved;
  };
  return {put_side(YarnPieces::start_x, YarnPieces::along_x, shift.x, view.slope.x, period.x, texel.x, low_x,
                   high_x),
          put_side(YarnPieces::start_y, YarnPieces::along_y, shift.y, view.slope.y, period.y, texel.y, low_y,
                   high_y)};
}

/// Radii of N pieces as rays see them; `shown`: whether they meet any, 1 or 0.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> seen_radius(const YarnPieces& pieces, int base, const SplatView& view,
                                         float* shown) {
  using Wide = WideFloat<N>;
  const Wide zero(0);
  const Wide one(1);
  const Wide rank = Wide::load(&pieces.numbers[YarnPieces::hair_threshold][base]);
  const Wide radius = Wide::load(&pieces.numbers[YarnPieces::radius][base]);
  const Wide bound = Wide::load(&pieces.numbers[YarnPieces::bounding_radius][base]);
  const Wide wider = min(max(Wide(view.ray_width / 2), radius), bound);
  if_greater(rank, zero, if_greater(radius, wider * rank, one, zero), one).store(shown);
  return if_greater(rank, zero, wider, radius);
}

/// Sets up N pieces from `base` on; false if none of them shows.
template <std::size_t N>
SELVEDGE_INLINE bool set_up(const YarnPieces& pieces, int base, const V2f& shift, const V2f& period,
                            float plane, const SplatView& view, const V2f& texel, float (*to)[N]) {
  using Wide = WideFloat<N>;
  const auto number = [&](YarnPieces::Number n) __attribute__((always_inline)) {
    return Wide::load(&pieces.numbers[n][base]);
  };
  const Wide zero(0);
  const Wide one(1);
  Wide radius = number(YarnPieces::radius);
  std::fill_n(to[shown], N, 1.0F);
  if (base + static_cast<int>(N) > pieces.ply_piece_count) {
    radius = seen_radius<N>(pieces, base, view, to[shown]);
    if (!any_greater(Wide::load(to[shown]), zero)) return false;
  }
  const Wide kx(view.slope.x);
  const Wide ky(view.slope.y);
  const Wide sx = number(YarnPieces::start_x) + Wide(shift.x);
  const Wide sy = number(YarnPieces::start_y) + Wide(shift.y);
  const Wide sz = number(YarnPieces::start_z);
  const Wide gx = number(YarnPieces::squeeze_x);
  const Wide gy = number(YarnPieces::squeeze_y);
  const Wide gz = number(YarnPieces::squeeze_z);
  const Wide ax = number(YarnPieces::axis_x);
  const Wide ay = number(YarnPieces::axis_y);
  const Wide az = number(YarnPieces::axis_z);
  // The ray (x, y, 0) + t (kx, ky, 1) in the round section: f0 + x fx + y fy + t e.
  const Wide part_e = gx * kx + gy * ky + gz;
  const Wide ex = kx - gx * part_e;
  const Wide ey = ky - gy * part_e;
  const Wide ez = one - gz * part_e;
  const Wide along_e = ax * ex + ay * ey + az * ez;
  const Wide e2 = ex * ex + ey * ey + ez * ez;
  const Wide inverse = one / max(e2 - along_e * along_e, e2 * Wide(1e-7F));
  const Wide nx = ey * az - ez * ay;
  const Wide ny = ez * ax - ex * az;
  const Wide nz = ex * ay - ey * ax;
  const Wide cx = -(kx * Wide(plane)) - sx;
  const Wide cy = -(ky * Wide(plane)) - sy;
  const Wide cz = -sz;
  const Wide part_c = gx * cx + gy * cy + gz * cz;
  const Wide f0x = cx - gx * part_c;
  const Wide f0y = cy - gy * part_c;
  const Wide f0z = cz - gz * part_c;
  const Wide fxx = one - gx * gx;
  const Wide fxy = -(gx * gy);
  const Wide fyy = one - gy * gy;
  const Wide fxz = -(gx * gz);
  const Wide fyz = -(gy * gz);
  Wide g[3] = {(f0x * nx + f0y * ny + f0z * nz) * inverse,  // NOLINT
               (fxx * nx + fxy * ny + fxz * nz) * inverse, (fxy * nx + fyy * ny + fyz * nz) * inverse};
  Wide w[3] = {ax * f0x + ay * f0y + az * f0z, ax * fxx + ay * fxy + az * fxz,  // NOLINT
               ax * fxy + ay * fyy + az * fyz};
  Wide z[3] = {(w[0] * along_e - (ex * f0x + ey * f0y + ez * f0z)) * inverse,  // NOLINT
               (w[1] * along_e - (ex * fxx + ey * fxy + ez * fxz)) * inverse,
               (w[2] * along_e - (ex * fxy + ey * fyy + ez * fyz)) * inverse};
  const Wide radius2 = radius * radius * inverse;
  const std::array<Wide, 2> moved = put_box<N>(pieces, base, shift, radius, period, plane, view, texel, to);
  const Wide half(0.5F);
  const auto put = [&](Linear n, const Wide& value) __attribute__((always_inline)) { value.store(to[n]); };
  const auto put_linear = [&](Linear first, const Wide* c) __attribute__((always_inline)) {
    const Wide in_x = c[1] * Wide(texel.x);
    const Wide in_y = c[2] * Wide(texel.y);
    (c[0] + c[1] * moved[0] + c[2] * moved[1] + half * (in_x + in_y)).store(to[first]);
    in_x.store(to[first + 1]);
    in_y.store(to[first + 2]);
  };
  put_linear(g_at, g);
  put_linear(z_at, z);
  put_linear(w_at, w);
  put(r2, radius2);
  put(r, sqrt(radius2));
  const Wide per_texel = g[1] * Wide(texel.x);
  put(inverse_g_x, if_greater(abs(per_texel), Wide(1e-9F), one / per_texel, zero));
  put(w_depth, along_e);
  const Wide over = number(YarnPieces::joint);
  const Wide high = number(YarnPieces::length) + over;
  put(low_w, -over);
  put(high_w, high);
  const Wide axis = (w[1] + along_e * z[1]) * Wide(texel.x);
  put(inverse_axis_x, if_greater(abs(axis), Wide(1e-9F), one / axis, zero));
  const Wide root = sqrt(radius2);
  put(min_axis, -over - max(along_e, zero) * root);
  put(max_axis, high + max(-along_e, zero) * root);
  return true;
}

/// Calls body(i, texel, count) for the runs of texels of a window that [low, high] and its copies show.
template <class Body>
SELVEDGE_INLINE void each_copy(float low, float high, int begin, int count, int period, const Body& body) {
  if (!(low <= high)) return;  // then an end may lie beyond what integers hold
  const auto first = static_cast<int>(std::ceil(low));
  const auto last = static_cast<int>(std::floor(high));
  while (begin + count - period > first) begin -= period;
  while (begin + count <= first) begin += period;
  for (; begin <= last; begin += period) {
    const int from = std::max(first, begin);
    body(from, from - begin, std::min(last, begin + count - 1) - from + 1);
  }
}

/// Numbers of 4 bytes in 4 columns of N / 4 rows.
template <std::size_t N>
struct Tile {
  static constexpr int columns = 4;
  static constexpr int rows = static_cast<int>(N) / columns;
  template <class Number>
  static SELVEDGE_INLINE WideFloat<N> load(const Number* from, int stride) {
    Floats4 row[rows];  // NOLINT(modernize-avoid-c-arrays): GCC keeps it in registers
    for (int i = 0; i < rows; ++i) std::memcpy(&row[i], from + i * stride, sizeof row[i]);
    if constexpr (N == 4) {
      return WideFloat<N>(row[0]);
    } else if constexpr (N == 8) {
      return WideFloat<N>(__builtin_shufflevector(row[0], row[1], 0, 1, 2, 3, 4, 5, 6, 7));
    } else {
      const Floats8 lower = __builtin_shufflevector(row[0], row[1], 0, 1, 2, 3, 4, 5, 6, 7);
      const Floats8 upper = __builtin_shufflevector(row[2], row[3], 0, 1, 2, 3, 4, 5, 6, 7);
      return WideFloat<N>(
          __builtin_shufflevector(lower, upper, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
    }
  }
  template <class Number>
  static SELVEDGE_INLINE void store(const WideFloat<N>& tile, Number* to, int stride) {
    Number numbers[N];  // NOLINT(modernize-avoid-c-arrays): GCC keeps it in registers
    std::memcpy(numbers, &tile.v, sizeof numbers);
    for (int i = 0; i < rows; ++i)
      std::memcpy(to + i * stride, numbers + i * columns, columns * sizeof(Number));
  }
};
static_assert(rows_behind >= Tile<16>::rows - 1);

/// Draws piece `number`, lane i of `fields`.
template <std::size_t N, bool with_pieces>
SELVEDGE_INLINE void draw(const float (*fields)[N], int i, std::int32_t number, DepthGrid& grid) {
  using Wide = WideFloat<N>;
  using Texels = Tile<N>;
  Wide column_of_lane;
  Wide row_of_lane;
  for (int k = 0; k < static_cast<int>(N); ++k) {
    const int row = k / Texels::columns;
    column_of_lane.v[k] = static_cast<float>(k - row * Texels::columns);
    row_of_lane.v[k] = static_cast<float>(row);
  }
  const float inverse = fields[inverse_g_x][i];
  const float half = fields[r][i] * std::abs(inverse);
  const float per = fields[inverse_axis_x][i];
  const Wide radius2(fields[r2][i]);
  const Wide gx(fields[g_x][i]);
  const Wide zx(fields[z_x][i]);
  const Wide wx(fields[w_x][i]);
  const Wide wz(fields[w_depth][i]);
  const Wide low(fields[low_w][i]);
  const Wide high(fields[high_w][i]);
  const Wide nothing(no_depth);
  Wide own;
  for (std::size_t k = 0; with_pieces && k < N; ++k) own.v[k] = std::bit_cast<float>(number);
  const auto draw_rows = [&](int j, int row) __attribute__((always_inline)) {
    float left = fields[low_x][i];
    float right = fields[high_x][i];
    // Bounds are linear in the row: the first and the last row's bound all.
    const auto bound = [&](float one, float other) __attribute__((always_inline)) {
      left = std::max(left, std::min(one, other));
      right = std::min(right, std::max(one, other));
    };
    const auto y = static_cast<float>(j);
    const auto last = static_cast<float>(j + Texels::rows - 1);
    if (inverse != 0) {
      const auto middle = [&](float at) { return -(fields[g_at][i] + fields[g_y][i] * at) * inverse; };
      const auto [low_middle, high_middle] = std::minmax({middle(y), middle(last)});
      bound(low_middle - half, high_middle + half);
    }
    if (per != 0) {
      const auto ends = [&](float at) {
        const float depth = fields[z_at][i] + fields[z_y][i] * at;
        const float axis = fields[w_at][i] + fields[w_y][i] * at + fields[w_depth][i] * depth;
        return std::minmax({(fields[min_axis][i] - axis) * per, (fields[max_axis][i] - axis) * per});
      };
      const auto [first_low, first_high] = ends(y);
      const auto [last_low, last_high] = ends(last);
      bound(std::min(first_low, last_low), std::max(first_high, last_high));
    }
    const Wide at = Wide(y) + row_of_lane;
    const Wide gr = Wide(fields[g_at][i]) + Wide(fields[g_y][i]) * at;
    const Wide zr = Wide(fields[z_at][i]) + Wide(fields[z_y][i]) * at;
    const Wide wr = Wide(fields[w_at][i]) + Wide(fields[w_y][i]) * at;
    const std::size_t first = static_cast<std::size_t>(row) * grid.stride;
    each_copy(
        left, right, grid.window_origin.x, grid.width,
        grid.period.x, [&](int c, int column, int count) __attribute__((always_inline)) {
          for (; count > 0; count -= Texels::columns, c += Texels::columns, column += Texels::columns) {
            float* const depths = &grid.z[first + column];
            const Wide x = Wide(static_cast<float>(c)) + column_of_lane;
            const Wide distance = gr + gx * x;
            const Wide inside = radius2 - distance * distance;
            const Wide z = zr + zx * x + sqrt(max(inside, Wide(0)));
            const Wide place = wr + wx * x + z * wz;
            const Wide meets = min(inside, min(place - low, high - place));
            const Wide seen = if_greater(Wide(0), meets, nothing, z);
            const Wide before = Texels::load(depths, grid.stride);
            Texels::store(max(seen, before), depths, grid.stride);
            if constexpr (with_pieces) {
              std::int32_t* const pieces = &grid.piece[first + column];
              Texels::store(if_greater(seen, before, own, Texels::load(pieces, grid.stride)), pieces,
                            grid.stride);
            }
          }
        });
  };
  each_copy(fields[low_y][i], fields[high_y][i], grid.window_origin.y, grid.height, grid.period.y,
            [&](int j, int row, int count) {
              for (; count > 0; count -= Texels::rows, j += Texels::rows, row += Texels::rows)
                draw_rows(j, row);
            });
}

/// Blends hair `number`, lane i of `fields`, over texels.
template <std::size_t N>
SELVEDGE_INLINE void blend(const float (*fields)[N], int i, const HairColours& colours, const DepthGrid& seen,
                           std::size_t hair, std::span<Group> raw) {
  using Wide = WideFloat<N>;
  const std::size_t planes = raw.size() / (static_cast<std::size_t>(seen.width) * seen.height);
  const float* const colour = colours.colours[colours.shadings[hair] * planes].data();
  const float gx = fields[g_x][i];
  // Distances in texels: a line of 2 `wide` that passes `beside` a texel's centre covers so much of it.
  const float per_texel = std::sqrt(gx * gx + fields[g_y][i] * fields[g_y][i]);
  const float inverse_per = 1 / std::max(per_texel, 1e-12F);
  const float wide = fields[r][i] * inverse_per;
  const float most = std::min(2 * wide, 1.0F);
  const float middle = 0.8F * fields[r][i];  // mean height of the visible half over the axis
  const float inverse = fields[inverse_g_x][i];
  const float half = (fields[r][i] + 0.5F * per_texel) * std::abs(inverse);
  const auto blend_row = [&](int j, int row) __attribute__((always_inline)) {
    const auto y = static_cast<float>(j);
    const float g = fields[g_at][i] + fields[g_y][i] * y;
    float left = fields[low_x][i] - 0.5F;
    float right = fields[high_x][i] + 0.5F;
    if (inverse != 0) {
      left = std::max(left, -g * inverse - half);
      right = std::min(right, -g * inverse + half);
    }
    const float depth = fields[z_at][i] + fields[z_y][i] * y;
    const float along = fields[w_at][i] + fields[w_y][i] * y;
    const float* const depths = &seen.z[static_cast<std::size_t>(row) * seen.stride];
    const auto blend_columns = [&](int c, int column, int count) __attribute__((always_inline)) {
      for (; count > 0; --count, ++c, ++column) {
        const auto x = static_cast<float>(c);
        const float fraction = std::min(wide + 0.5F - std::abs(g + gx * x) * inverse_per, most);
        const float z = depth + fields[z_x][i] * x;
        const float place = along + fields[w_x][i] * x + z * fields[w_depth][i];
        if (!(fraction > 0) || place < fields[low_w][i] || place > fields[high_w][i]) continue;
        if (depths[column] > z + middle) continue;
        float* const to = raw[(static_cast<std::size_t>(row) * seen.width + column) * planes].data();
        const auto blend_at = [&]<std::size_t M>(std::size_t k, WideFloat<M> under) {
          under = WideFloat<M>::load(to + k);
          (under + WideFloat<M>(fraction) * (WideFloat<M>::load(colour + k) - under)).store(to + k);
        };
        std::size_t k = 0;
        for (; k + N <= 4 * planes; k += N) blend_at(k, Wide());
        for (; k < 4 * planes; k += 4) blend_at(k, WideFloat<4>());
      }
    };
    each_copy(left, right, seen.window_origin.x, seen.width, seen.period.x, blend_columns);
  };
  each_copy(fields[low_y][i] - 0.5F, fields[high_y][i] + 0.5F, seen.window_origin.y, seen.height,
            seen.period.y, [&](int j, int row, int count) {
              for (; count > 0; --count) blend_row(j++, row++);
            });
}

template <std::size_t N>
SELVEDGE_INLINE void splat_pieces(const YarnPieces& pieces, const V2f& period, float plane,
                                  const SplatView& view, std::span<const ShownRange> ranges,
                                  DepthGrid& grid) {
  const V2f texel = period / V2f(grid.period);
  alignas(64) float fields[linear_count][N];  // NOLINT(modernize-avoid-c-arrays): vectors of known alignment
  for (const ShownRange& range : ranges) {
    for (int base = range.begin; base < range.end; base += static_cast<int>(N)) {
      if (!set_up<N>(pieces, base, range.shift, period, plane, view, texel, fields)) continue;
      const int lanes = std::min(static_cast<int>(N), range.end - base);
      for (int i = 0; i < lanes; ++i) {
        if (!(fields[shown][i] > 0)) continue;
        if (grid.piece.empty())
          draw<N, false>(fields, i, base + i, grid);
        else
          draw<N, true>(fields, i, base + i, grid);
      }
    }
  }
}
SELVEDGE_THREE_BODIES(splat_pieces,
                      (const YarnPieces& pieces, const V2f& period, float plane, const SplatView& view,
                       std::span<const ShownRange> ranges, DepthGrid& grid),
                      (pieces, period, plane, view, ranges, grid))

template <std::size_t N>
SELVEDGE_INLINE void blend_pieces(const YarnPieces& pieces, const V2f& period, float plane,
                                  const SplatView& view, const DepthGrid& seen,
                                  std::span<const ShownRange> hairs, const HairColours& colours,
                                  std::span<Group> raw) {
  const V2f texel = period / V2f(seen.period);
  alignas(64) float fields[linear_count][N];  // NOLINT(modernize-avoid-c-arrays): vectors of known alignment
  std::size_t hair = 0;
  for (const ShownRange& range : hairs) {
    for (int base = range.begin; base < range.end; base += static_cast<int>(N)) {
      const int lanes = std::min(static_cast<int>(N), range.end - base);
      const bool any = set_up<N>(pieces, base, range.shift, period, plane, view, texel, fields);
      for (int i = 0; i < lanes; ++i, ++hair)
        if (any && fields[shown][i] > 0) blend<N>(fields, i, colours, seen, hair, raw);
    }
  }
}
SELVEDGE_THREE_BODIES(blend_pieces,
                      (const YarnPieces& pieces, const V2f& period, float plane, const SplatView& view,
                       const DepthGrid& seen, std::span<const ShownRange> hairs, const HairColours& colours,
                       std::span<Group> raw),
                      (pieces, period, plane, view, seen, hairs, colours, raw))

template <std::size_t N>
SELVEDGE_INLINE void find_hairs(const YarnPieces& pieces, const V2f& period, float plane,
                                const SplatView& view, const DepthGrid& window,
                                std::span<const ShownRange> ranges, std::vector<SeenHair>& hairs) {
  using Wide = WideFloat<N>;
  const V2f texel = period / V2f(window.period);
  alignas(64) float fields[linear_count][N];  // NOLINT(modernize-avoid-c-arrays): vectors of known alignment
  const auto reaches = [&](Linear low, Linear high, int i, int begin, int count, int repeat) {
    bool found = false;
    each_copy(fields[low][i] - 0.5F, fields[high][i] + 0.5F, begin, count, repeat,
              [&](int, int, int) { found = true; });
    return found;
  };
  std::uint32_t number = 0;
  for (const ShownRange& range : ranges) {
    for (int base = range.begin; base < range.end; base += static_cast<int>(N)) {
      const int lanes = std::min(static_cast<int>(N), range.end - base);
      const Wide radius = seen_radius<N>(pieces, base, view, fields[shown]);
      radius.store(fields[r]);
      put_box<N>(pieces, base, range.shift, radius, period, plane, view, texel, fields);
      for (int i = 0; i < lanes; ++i, ++number)
        if (fields[shown][i] > 0 &&
            reaches(low_x, high_x, i, window.window_origin.x, window.width, window.period.x) &&
            reaches(low_y, high_y, i, window.window_origin.y, window.height, window.period.y))
          hairs.push_back({base + i, number, fields[r][i], range.shift});
    }
  }
}
SELVEDGE_THREE_BODIES(find_hairs,
                      (const YarnPieces& pieces, const V2f& period, float plane, const SplatView& view,
                       const DepthGrid& window, std::span<const ShownRange> ranges,
                       std::vector<SeenHair>& hairs),
                      (pieces, period, plane, view, window, ranges, hairs))

/// Windows of rays that stand for `width` mm, along one axis.
struct WindowAxis {
  float period;
  int texels, first, count;  ///< of the period and of the window
  float slope, plane;
  float texel = period / static_cast<float>(texels);
  // Lines of hairs reach half a texel farther, and numbers are rounded.
  float begin = (static_cast<float>(first) - 1) * texel;
  float length = (static_cast<float>(count) + 2) * texel;
  /// Whether the rays may pass a box that is `wider` at its ends.
  bool meets(float low, float high, float low_z, float high_z, float wider) const {
    const float lifted = std::max(slope * (low_z - plane), slope * (high_z - plane));
    const float lowered = std::min(slope * (low_z - plane), slope * (high_z - plane));
    const float beside = wider * (1 + std::abs(slope));
    const float from = low - lifted - beside;
    const float to = high - lowered + beside;
    if (to - from + length >= period) return true;
    const float after = from - begin;
    const float at = after - std::floor(after / period) * period;
    return at <= length || at + (to - from) >= period;
  }
};

void append(const PieceRange& range, const V2f& shift, std::vector<ShownRange>& to) {
  if (!to.empty() && to.back().end == range.begin && to.back().shift == shift)
    to.back().end = range.end;
  else if (range.begin < range.end)
    to.push_back({range, shift});
}

static_assert(columns_behind <= min_cell_texels);

}  // namespace

void DepthGrid::resize(const CellSize& image, bool with_pieces) {
  size = image;
  period = image.repeat_samples;
  window_origin = image.window_origin;
  width = image.rendered_samples().x;
  height = image.rendered_samples().y;
  stride = stride_of(width);
  z.assign(static_cast<std::size_t>(stride) * (height + rows_behind), no_depth);
  piece.resize(with_pieces ? z.size() : 0);
}

V2f image_period(const CellYarn& yarn, const CellSize& size) {
  return size.shows_map ? yarn.yarns().tile() : yarn.yarns().period();
}

V2f ray_slope(const V3f& direction) {
  const float rise = std::max(direction.z, min_ray_rise);
  return {direction.x / rise, direction.y / rise};
}

int ShownPieces::hair_count() const {
  int count = 0;
  for (const ShownRange& range : hairs) count += range.end - range.begin;
  return count;
}

void find_pieces(const CellYarn& yarn, const YarnPieces& pieces, const SplatView& view,
                 const DepthGrid& window, ShownPieces& shown) {
  shown.plies.clear();
  shown.hairs.clear();
  const V2f period = image_period(yarn, window.size);
  const float plane = yarn.reference_height();
  const WindowAxis x{period.x, window.period.x, window.window_origin.x, window.width, view.slope.x, plane};
  const WindowAxis y{period.y, window.period.y, window.window_origin.y, window.height, view.slope.y, plane};
  const float hair_radius =
      std::min(std::max(view.ray_width / 2, pieces.thickest_hair_radius), pieces.widest_hair_radius);
  const float min_shown_radius = std::min(view.ray_width / 2, pieces.min_hair_bound);
  constexpr float rounding = 1.001F;
  const auto meets = [&](const YarnPieces::Run& run, bool is_hair, const V2f& shift) {
    const V3f& low = run.box.min;
    const V3f& high = run.box.max;
    const float wider = is_hair ? hair_radius : 0;
    return min_shown_radius < rounding * run.max_width &&
           x.meets(low.x + shift.x, high.x + shift.x, low.z, high.z, wider) &&
           y.meets(low.y + shift.y, high.y + shift.y, low.z, high.z, wider);
  };
  const YarnMap& map = yarn.yarns().data().map;
  const V2f cell = yarn.yarns().period() / V2f(map.kinds);
  const float relief = std::max(pieces.box.max.z - plane, plane - pieces.box.min.z);
  V2i first(0, 0);
  V2i end = map.kinds;
  for (int axis = 0; axis < 2 && window.size.shows_map; ++axis) {
    const float texel = period[axis] / static_cast<float>(window.period[axis]);
    const float around = pieces.reach_beyond_stitch[axis] + hair_radius +
                         std::abs(view.slope[axis]) * (relief + hair_radius) + texel;
    const float from = static_cast<float>(window.size.unwrapped_origin()[axis]) * texel;
    const float to = from + static_cast<float>(axis == 0 ? window.width : window.height) * texel;
    first[axis] = static_cast<int>(std::floor((from - around) / cell[axis]));
    end[axis] = static_cast<int>(std::ceil((to + around) / cell[axis]));
  }
  for (V2i at = first; at.y < end.y; at = at.x + 1 < end.x ? at + V2i(1, 0) : V2i(first.x, at.y + 1)) {
    const V2i kind = window.size.shows_map ? map.shown_upwards(window.size.first_stitch + at) : at;
    const V2f shift = V2f(at - kind) * cell;
    const auto add = [&](const PieceRange& groups, bool is_hair, std::vector<ShownRange>& to) {
      for (int k = groups.begin; k < groups.end; ++k) {
        const YarnPieces::Run& group = pieces.groups[k];
        if (!meets(group, is_hair, shift)) continue;
        for (int i = group.range.begin; i < group.range.end; ++i)
          if (meets(pieces.runs[i], is_hair, shift)) append(pieces.runs[i].range, shift, to);
      }
    };
    const YarnPieces::Stitch& stitch = pieces.stitches[std::size_t{1} * kind.y * map.kinds.x + kind.x];
    add(stitch.plies, false, shown.plies);
    if (view.has_hairs) add(stitch.hairs, true, shown.hairs);
  }
}

void find_hairs(const CellYarn& yarn, const YarnPieces& pieces, const SplatView& view,
                const DepthGrid& window, std::span<const ShownRange> ranges, std::vector<SeenHair>& hairs) {
  find_hairs_for_this_processor(pieces, image_period(yarn, window.size), yarn.reference_height(), view,
                                window, ranges, hairs);
}

void blend_hairs(const CellYarn& yarn, const YarnPieces& pieces, const SplatView& view, const DepthGrid& seen,
                 std::span<const ShownRange> hairs, const HairColours& colours, std::span<Group> raw) {
  blend_pieces_for_this_processor(pieces, image_period(yarn, seen.size), yarn.reference_height(), view, seen,
                                  hairs, colours, raw);
}

void splat(const CellYarn& yarn, const YarnPieces& pieces, const SplatView& view,
           std::span<const ShownRange> ranges, DepthGrid& grid) {
  splat_pieces_for_this_processor(pieces, image_period(yarn, grid.size), yarn.reference_height(), view,
                                  ranges, grid);
  for (int row = 0; row < grid.height && grid.width == grid.period.x; ++row) {
    const auto begin = grid.z.begin() + static_cast<std::ptrdiff_t>(row) * grid.stride;
    std::copy_n(begin, columns_behind, begin + grid.width);
  }
}

void splat(const CellYarn& yarn, const YarnPieces& pieces, const SplatView& view, DepthGrid& grid) {
  ShownPieces shown;
  find_pieces(yarn, pieces, view, grid, shown);
  splat(yarn, pieces, view, shown.plies, grid);
  splat(yarn, pieces, view, shown.hairs, grid);
}

}  // namespace selvedge
