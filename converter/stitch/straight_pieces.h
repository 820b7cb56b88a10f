// Nearest points of straight pieces of yarn.
#pragma once

#include <algorithm>

#include "format/base/vec.h"

namespace selvedge {

struct Nearest {
  double s, t;  ///< along either piece, 0 to 1
};

/// Nearest points of two straight pieces.
inline Nearest nearest_of(const V3d& a, const V3d& along_a, const V3d& b, const V3d& along_b) {
  const V3d between = a - b;
  const double aa = std::max(along_a.length2(), 1e-300);
  const double bb = std::max(along_b.length2(), 1e-300);
  const double ab = along_a.dot(along_b);
  const double ca = along_a.dot(between);
  const double cb = along_b.dot(between);
  const double parallel = aa * bb - ab * ab;
  double s = parallel > 1e-9 * aa * bb ? std::clamp((ab * cb - ca * bb) / parallel, 0.0, 1.0) : 0.5;
  double t = (ab * s + cb) / bb;
  if (t < 0 || t > 1) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((ab * t - ca) / aa, 0.0, 1.0);
  }
  return {s, t};
}

}  // namespace selvedge
