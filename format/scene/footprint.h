// The texels under a pixel: mip level and weights from the change of texture coordinates across it
// (spec/brdf.md, "The viewer"). viewer/shader/footprint.glsl has the same formulas in GLSL. T is float, or
// WideFloat for several pixels.
#pragma once

#include <cmath>

#include "format/simd/wide_float.h"

namespace selvedge {

/// Change of texture coordinates per pixel to the right and per pixel up, in texels of a level.
template <class T>
struct TexelSlopes {
  T x_along_right, y_along_right, x_along_up, y_along_up;
};

/// Longer axis of a pixel by its width across, up to which it counts with its area alone; a longer pixel
/// counts as an area so much shorter.
inline constexpr float max_elongation = 8;

/// Width of the largest pixel among the texels of its level, which only the coarsest levels exceed.
inline constexpr float max_pixel_size = 3.5F;

/// A level's texels along each side that lie under one pixel.
inline constexpr int max_pixel_texels = 8;

SELVEDGE_INLINE float wide_log2(float x) { return std::log2(x); }
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> wide_log2(const WideFloat<N>& x) {
  WideFloat<N> result;
  Lanes<N>::natural_log(x.v, result.v);
  return result * WideFloat<N>(1.44269504088896341F);
}
SELVEDGE_INLINE float if_greater(float a, float b, float yes, float no) { return a > b ? yes : no; }
SELVEDGE_INLINE float larger(float a, float b) { return a > b ? a : b; }
SELVEDGE_INLINE float smaller(float a, float b) { return b > a ? a : b; }
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> larger(const WideFloat<N>& a, const WideFloat<N>& b) {
  return max(a, b);
}
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> smaller(const WideFloat<N>& a, const WideFloat<N>& b) {
  return min(a, b);
}

/// Width of a square of the pixel's area, in texels of the slopes' level.
template <class T>
SELVEDGE_INLINE T pixel_size(const TexelSlopes<T>& s) {
  using std::abs;
  using std::sqrt;
  const T e = s.x_along_right * s.x_along_right + s.x_along_up * s.x_along_up;
  const T f = s.x_along_right * s.y_along_right + s.x_along_up * s.y_along_up;
  const T g = s.y_along_right * s.y_along_right + s.y_along_up * s.y_along_up;
  const T half = (e - g) * T(0.5F);
  const T long2 = (e + g) * T(0.5F) + sqrt(half * half + f * f);
  const T area = abs(s.x_along_right * s.y_along_up - s.y_along_right * s.x_along_up);
  return sqrt(larger(larger(area, long2 * T(1 / max_elongation)), T(1e-24F)));
}

/// The pixel as a parallelogram among the texels of a level, at least as wide as a texel.
template <class T>
struct PixelBox {
  T across_x, across_y;  ///< a pixel's coordinate to the right is across . (x, y), -1/2 to 1/2 within it
  T along_x, along_y;    ///< the same upwards
  T texel_across;        ///< size of a texel in these coordinates
  T texel_along;
  T reach_x, reach_y;  ///< texels whose centres are further away have no share
};

/// `slopes` and `size` (pixel_size()) in texels of the level.
template <class T>
SELVEDGE_INLINE PixelBox<T> pixel_box(const TexelSlopes<T>& slopes, const T& size) {
  using std::abs;
  using std::sqrt;
  const T one(1);
  const T zero(0);
  const T tiny(1e-12F);
  const T shrink = smaller(T(max_pixel_size) / size, one);
  T rx = slopes.x_along_right * shrink;
  T ry = slopes.y_along_right * shrink;
  T ux = slopes.x_along_up * shrink;
  T uy = slopes.y_along_up * shrink;
  // A side shorter than a texel becomes as long as one: texels are then interpolated.
  const T right = sqrt(rx * rx + ry * ry);
  const T up = sqrt(ux * ux + uy * uy);
  const T longer_right = if_greater(one, right, one / larger(right, tiny), one);
  const T longer_up = if_greater(one, up, one / larger(up, tiny), one);
  rx = if_greater(right, tiny, rx * longer_right, one);
  ry = if_greater(right, tiny, ry * longer_right, zero);
  ux = if_greater(up, tiny, ux * longer_up, zero);
  uy = if_greater(up, tiny, uy * longer_up, one);
  // A parallelogram thinner than a texel becomes a strip of both sides' length.
  const T length = sqrt(rx * rx + ry * ry);
  const T dot = rx * ux + ry * uy;
  const T area = rx * uy - ry * ux;
  const T thick = if_greater(abs(area), smaller(length, sqrt(ux * ux + uy * uy)) * T(0.5F), one, zero);
  const T sign = if_greater(dot, zero, one, -one);
  const T sx = rx + sign * ux;
  const T sy = ry + sign * uy;
  const T strip = sqrt(larger(sx * sx + sy * sy, tiny));
  rx = if_greater(thick, zero, rx, sx);
  ry = if_greater(thick, zero, ry, sy);
  ux = if_greater(thick, zero, ux, -sy / strip);
  uy = if_greater(thick, zero, uy, sx / strip);
  const T inverse = one / (rx * uy - ry * ux);
  PixelBox<T> box;
  box.across_x = uy * inverse;
  box.across_y = -ux * inverse;
  box.along_x = -ry * inverse;
  box.along_y = rx * inverse;
  box.texel_across = sqrt(box.across_x * box.across_x + box.across_y * box.across_y);
  box.texel_along = sqrt(box.along_x * box.along_x + box.along_y * box.along_y);
  const T most(0.5F * max_pixel_texels);
  const T half(0.5F);
  const T wide = (one + box.texel_across) * half;
  const T high = (one + box.texel_along) * half;
  box.reach_x = smaller(abs(rx) * wide + abs(ux) * high, most);
  box.reach_y = smaller(abs(ry) * wide + abs(uy) * high, most);
  return box;
}

/// Share of a texel whose centre lies (x, y) texels from the pixel's, times a constant: exactly the area
/// under the pixel where both have the same directions.
template <class T>
SELVEDGE_INLINE T texel_share(const PixelBox<T>& box, const T& x, const T& y) {
  using std::abs;
  const T half(0.5F);
  const T one(1);
  const T zero(0);
  const T a = abs(box.across_x * x + box.across_y * y);
  const T b = abs(box.along_x * x + box.along_y * y);
  const T across = smaller(larger((one + box.texel_across) * half - a, zero), smaller(box.texel_across, one));
  const T along = smaller(larger((one + box.texel_along) * half - b, zero), smaller(box.texel_along, one));
  return if_greater(box.reach_x, abs(x), if_greater(box.reach_y, abs(y), across * along, zero), zero);
}

/// The coarser one's weight of two neighbouring levels, from the part of a fractional level behind the point:
/// half of the pixels show one level alone, or most for `steep` ramps.
template <class T>
SELVEDGE_INLINE T blend_of_levels(const T& part, bool blends, float steep = 2) {
  const T slope(blends ? steep : 1e6F);
  return smaller(larger((part - T(0.5F)) * slope + T(0.5F), T(0)), T(1));
}

/// Scale of largest_yarn_pixel(), which assumes 2 x 2 points: n x n points show the yarn
/// itself in larger pixels, chosen by pictures (docs/view.md).
SELVEDGE_INLINE float largest_by_points(int points) { return larger(0.5F, static_cast<float>(points - 1)); }

/// Weight of the yarn itself for a pixel of `size` (pixel_size()), where `largest` is largest_yarn_pixel(); 0
/// without yarn.
template <class T>
SELVEDGE_INLINE T yarn_share(const T& size, const T& largest, bool blends) {
  return if_greater(largest, T(0), blend_of_levels(wide_log2(largest / size) + T(0.5F), blends, 4), T(0));
}

}  // namespace selvedge
