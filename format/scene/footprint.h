// Mip levels and taps of a pixel from the change of texture coordinates across it (spec/brdf.md, "The
// viewer"). viewer/shader/footprint.glsl has the same formula.
#pragma once

#include <cmath>

#include "format/simd/wide_float.h"

namespace selvedge {

/// Change of texture coordinates per pixel to the right and per pixel up, in texels of level 0.
template <class T>
struct TexelSlopes {
  T x_along_right, y_along_right, x_along_up, y_along_up;
};

/// The ellipse that a pixel's disc of diameter 1 covers, in texels of level 0.
template <class T>
struct Footprint {
  T level;           ///< log2 of the diameter of one of `ratio` round parts; not clamped
  T ratio;           ///< long axis / short axis, between 1 and `taps`
  T axis_x, axis_y;  ///< vector between the centres of the outermost round parts, texels
};

SELVEDGE_INLINE float wide_log2(float x) { return std::log2(x); }
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> wide_log2(const WideFloat<N>& x) {
  WideFloat<N> result;
  Lanes<N>::natural_log(x.v, result.v);
  return result * WideFloat<N>(1.44269504088896341F);
}
SELVEDGE_INLINE float if_greater(float a, float b, float yes, float no) { return a > b ? yes : no; }

template <class T>
SELVEDGE_INLINE Footprint<T> footprint(const TexelSlopes<T>& s, float taps) {
  using std::sqrt;
  // Eigenvalues and the first eigenvector of the symmetric matrix (e f; f g).
  const T e = s.x_along_right * s.x_along_right + s.x_along_up * s.x_along_up;
  const T f = s.x_along_right * s.y_along_right + s.x_along_up * s.y_along_up;
  const T g = s.y_along_right * s.y_along_right + s.y_along_up * s.y_along_up;
  const T mean = (e + g) * T(0.5F);
  const T half = (e - g) * T(0.5F);
  const T root = sqrt(half * half + f * f);
  const T tiny(1e-24F);
  const T long2 = mean + root;
  const T long_kept = if_greater(long2, tiny, long2, tiny);
  const T short2 = mean - root;
  const T least2 = long_kept * T(1 / (taps * taps));
  const T short_kept = if_greater(short2, least2, short2, least2);
  const T x = if_greater(e, g, long2 - g, f);
  const T y = if_greater(e, g, f, long2 - e);
  const T length2 = x * x + y * y;
  Footprint<T> result;
  result.level = wide_log2(short_kept) * T(0.5F);
  result.ratio = sqrt(long_kept / short_kept);
  const T reach = (sqrt(long_kept) - sqrt(short_kept)) / sqrt(if_greater(length2, tiny, length2, tiny));
  result.axis_x = if_greater(length2, tiny, x * reach, T(0));
  result.axis_y = if_greater(length2, tiny, y * reach, T(0));
  return result;
}

}  // namespace selvedge
