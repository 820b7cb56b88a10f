// Interpolates between the directions of a grid (directions.h) for several pixels at once.
#pragma once

#include "format/fabric/directions.h"
#include "format/simd/wide_float.h"

namespace selvedge {

/// Four cells and their weights for each of N directions.
template <std::size_t N>
struct WideTaps {
  std::int32_t cell[4][N];  // NOLINT(modernize-avoid-c-arrays): written as a whole vector
  WideFloat<N> weight[4];   // NOLINT(modernize-avoid-c-arrays)
};

/// interpolate() of directions.h in single precision. The concentric map's four quarters are merged to two:
/// the longer of x and y gives the signed radius, their ratio the angle.
template <std::size_t N>
SELVEDGE_INLINE void wide_interpolate(const DirectionGrid& grid, const WideVec3<N>& d, WideTaps<N>& taps) {
  using Wide = WideFloat<N>;
  const Wide tiny(1e-30F);
  const Wide planar2 = d.x * d.x + d.y * d.y;
  const Wide z = max(min(d.z, Wide(1)), Wide(0));
  const Wide planar = sqrt(planar2);
  const Wide length = max(sqrt(planar2 + z * z), tiny);
  const Wide radius = planar / length / sqrt(Wide(1) + z / length);
  const Wide across_x = abs(d.x);
  const Wide across_y = abs(d.y);
  const Wide major = if_greater(across_x, across_y, d.x, d.y);
  const Wide minor = if_greater(across_x, across_y, d.y, d.x);
  const Wide signed_radius = if_greater(Wide(0), major, -radius, radius);
  const Wide ratio = minor / if_greater(abs(major), tiny, major, Wide(1));
  const Wide other = wide_arctan(ratio) * signed_radius * Wide(1.27323954473516F);
  const Wide a = if_greater(across_x, across_y, signed_radius, other);
  const Wide b = if_greater(across_x, across_y, other, signed_radius);
  const Wide half(0.5F);
  const Wide columns(static_cast<float>(grid.columns));
  const Wide rows(static_cast<float>(grid.rows));
  const Wide column = min(max((a * half + half) * columns - half, Wide(0)), columns - Wide(1));
  const Wide row = min(max((b * half + half) * rows - half, Wide(0)), rows - Wide(1));
  const Wide column0 = floor(column);
  const Wide row0 = floor(row);
  const Wide fc = column - column0;
  const Wide fr = row - row0;
  taps.weight[0] = (Wide(1) - fc) * (Wide(1) - fr);
  taps.weight[1] = fc * (Wide(1) - fr);
  taps.weight[2] = (Wide(1) - fc) * fr;
  taps.weight[3] = fc * fr;
  const Wide column1 = min(column0 + Wide(1), columns - Wide(1));
  const Wide row1 = min(row0 + Wide(1), rows - Wide(1));
  store_whole(row0 * columns + column0, taps.cell[0]);
  store_whole(row0 * columns + column1, taps.cell[1]);
  store_whole(row1 * columns + column0, taps.cell[2]);
  store_whole(row1 * columns + column1, taps.cell[3]);
}

}  // namespace selvedge
