// The garment's frame as the specification has it, and what a display makes of light.
#pragma once

#include <algorithm>
#include <cmath>

#include "format/base/vec.h"

namespace selvedge::test {

/// The frame of spec/brdf.md ("Garment frame", "The back"), plainly.
struct PlainFrame {
  V3d tangent, up, normal;
  V3f into(const V3d& d) const { return V3f(V3d(d.dot(tangent), d.dot(up), d.dot(normal))); }
};
inline PlainFrame plain_frame(const V3d& normal, const V3d& tangent, double handedness, double side,
                              const V3d& view) {
  PlainFrame f;
  f.normal = normal.normalized() * side;
  const double cosine = f.normal.dot(view);
  if (cosine < 0.01) f.normal = (f.normal + view * (0.01 - cosine)).normalized();
  f.tangent = (tangent - f.normal * f.normal.dot(tangent)).normalized();
  f.up = f.normal.cross(f.tangent) * (side * handedness);
  return f;
}

/// A value of a display, 1 being white.
inline double srgb(double linear) {
  const double c = std::clamp(linear, 0.0, 1.0);
  return c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
}

}  // namespace selvedge::test
