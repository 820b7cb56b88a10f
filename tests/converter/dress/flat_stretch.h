// How much cloth is stretched by a map into the plane.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "format/base/vec.h"

namespace selvedge::test {

/// Metres of surface per unit of the plane within one triangle: the singular values of dP/d(u, v).
struct Stretch {
  double max = 1;
  double min = 1;

  double times() const { return std::max(max, 1 / min); }
};

inline Stretch stretch_of(const std::array<V3d, 3>& corners, const std::array<V2d, 3>& plane) {
  const V2d a = plane[1] - plane[0];
  const V2d b = plane[2] - plane[0];
  const V3d p = corners[1] - corners[0];
  const V3d q = corners[2] - corners[0];
  const V3d along_u = (p * b.y - q * a.y) / (a % b);
  const V3d along_v = (q * a.x - p * b.x) / (a % b);
  const double middle = (along_u.length2() + along_v.length2()) / 2;
  const double spread = std::hypot((along_u.length2() - along_v.length2()) / 2, along_u.dot(along_v));
  return {std::sqrt(middle + spread), std::sqrt(std::max(0.0, middle - spread))};
}

}  // namespace selvedge::test
