// Rays through an endlessly repeated cell: one that leaves a block of cells sideways enters it again, shifted
// by whole periods.
#pragma once

#include <embree3/rtcore.h>

#include <algorithm>
#include <limits>

#include "converter/mesh/surface_points.h"
#include "format/base/vec.h"

namespace selvedge {

/// The block of cells that a ray crosses before it is shifted back.
struct CellBlock {
  V2d period{1, 1};
  double z_low = 0;  // the cell's lowest and highest z with a margin
  double z_high = 0;
  V2d min{0, 0};
  V2d max{1, 1};
};

/// Fraction of the way through the block after which a ray is shifted back. Less than 1, so that a wall
/// exactly at the end of the block lies ahead of the shifted ray.
inline constexpr double wrap_fraction = 1 - 1e-4;

/// Minimum slope: a horizontal ray would be shifted for ever.
inline constexpr int max_block_pieces = 4096;

/// Distance along the ray to the end of the interval, or infinity.
inline double interval_exit(double origin, double direction, double low, double high) {
  const double distance = ((direction > 0 ? high : low) - origin) / direction;
  return direction == 0 ? std::numeric_limits<double>::infinity() : distance;
}

inline RTCRay ray_from(const V3d& origin, const V3d& direction, double far) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x);
  ray.org_y = static_cast<float>(origin.y);
  ray.org_z = static_cast<float>(origin.z);
  ray.dir_x = static_cast<float>(direction.x);
  ray.dir_y = static_cast<float>(direction.y);
  ray.dir_z = static_cast<float>(direction.z);
  ray.tnear = 0;
  ray.tfar = static_cast<float>(far);
  ray.mask = 0xffffffffU;
  return ray;
}

/// Moves the origin of a ray from above or below onto the slab of the cell. False if the ray misses it.
inline bool enter_slab(const CellBlock& block, V3d& origin, const V3d& direction) {
  if (origin.z > block.z_high) {
    if (direction.z >= 0) return false;
    origin += direction * ((block.z_high - origin.z) / direction.z);
  }
  if (origin.z < block.z_low) {
    if (direction.z <= 0) return false;
    origin += direction * ((block.z_low - origin.z) / direction.z);
  }
  return true;
}

/// Walks a ray block by block. `step(origin, far)` traces one piece and returns whether to stop.
template <class Step>
bool walk_blocks(const CellBlock& block, V3d origin, const V3d& direction, const Step& step) {
  if (!enter_slab(block, origin, direction)) return false;
  for (int piece = 0; piece < max_block_pieces; ++piece) {
    origin.x = wrap_to_repeat(origin.x, block.period.x);
    origin.y = wrap_to_repeat(origin.y, block.period.y);
    const double out = interval_exit(origin.z, direction.z, block.z_low, block.z_high);
    const double side = std::min(interval_exit(origin.x, direction.x, block.min.x, block.max.x),
                                 interval_exit(origin.y, direction.y, block.min.y, block.max.y));
    if (step(origin, std::min(out, side))) return true;
    if (out <= side || side == std::numeric_limits<double>::infinity()) return false;
    origin += direction * (wrap_fraction * side);
  }
  return false;
}

}  // namespace selvedge
