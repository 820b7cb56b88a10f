// Directions over the hemisphere: the equal-area layout of stored views and lights, its interpolation,
// and random directions.
//
// The hemisphere z >= 0 is mapped onto the unit square by Shirley and Chiu's concentric map followed by the
// equal-area lift of the disc (z = 1 - r^2); a grid of columns x rows cuts the square into cells of equal
// solid angle. A cell's direction is the image of its centre; cell index = row * columns + column.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

/// An equal-area grid of directions. Both counts are at least 1.
struct DirectionGrid {
  int columns = 8;
  int rows = 8;
  int count() const { return columns * rows; }
  bool operator==(const DirectionGrid&) const = default;
};

/// The most nearly square grid with exactly `count` cells (columns <= rows): 64 -> 8x8, 128 -> 8x16, 7 ->
/// 1x7.
DirectionGrid nearly_square_grid(int count);

/// Shirley and Chiu's concentric map of the unit square onto the unit disc, area preserving up to the factor
/// pi: radius (of either sign) and angle.
V2d square_to_disc_polar(const V2d& square);

/// Maps the unit square onto the unit hemisphere, area preserving up to the factor 2 pi; (0.5, 0.5) -> +z.
V3d square_to_hemisphere(const V2d& square);

/// The inverse of square_to_hemisphere(). z < 0 is treated as z = 0 (the rim), (0, 0, -1) as the pole.
V2d hemisphere_to_square(const V3d& direction);

V3f cell_direction(const DirectionGrid& grid, int cell);
std::vector<V3f> cell_directions(const DirectionGrid& grid);

/// Four cells and their bilinear weights (sum 1). Beyond the outermost cell centres the coordinates are
/// clamped: values are constant towards the rim.
struct DirectionTaps {
  std::array<int, 4> cell;
  std::array<float, 4> weight;
  /// The weighted sum of values by cell.
  template <class T>
  T interpolated(const T* values) const {
    T sum(0);
    for (std::size_t tap = 0; tap < 4; ++tap) sum += weight[tap] * values[cell[tap]];
    return sum;
  }
};
DirectionTaps interpolate(const DirectionGrid& grid, const V3f& direction);
/// At a place of the unit square.
DirectionTaps interpolate(const DirectionGrid& grid, const V2d& square);

/// In the plane of the cloth.
inline V3f mirrored(const V3f& direction) { return {direction.x, direction.y, -direction.z}; }

struct DirectionPair {
  V3f light;
  V3f view;
};

/// `count` pairs, drawn independently and uniformly in solid angle from the band z_min <= z < 1 of the
/// hemisphere. The same seed gives the same pairs on every machine.
std::vector<DirectionPair> random_direction_pairs(int count, double z_min, std::uint64_t seed);

}  // namespace selvedge
