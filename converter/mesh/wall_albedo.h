// The albedo of the translucent wall that stands for a ply of fibres.
#pragma once

#include <algorithm>
#include <cmath>

#include "format/base/vec.h"

namespace selvedge {

/// How much lighter a ply is than any thickness of its fibres: calibrated against explicit ones
/// (docs/yarn.md).
inline constexpr double ply_gain = 1.6;

/// Albedo of the wall of a hollow ply whose total reflectance under uniform light is
/// 1 - (1 - albedo)^(1 + ply_gain t^2): less is absorbed in a ply than in as many fibres as light can reach.
/// A hollow body whose wall has the albedo x sends away x (1 - t) + (x t)^2 / (1 - x (1 - t)) wherever light
/// lands in it evenly; this is solved for x. No transmission leaves an albedo as it is; black and white stay.
inline double ply_wall_albedo(double albedo, double t) {
  if (t == 0 || albedo <= 0) return albedo;
  const double sent = 1 - std::pow(1 - std::min(1.0, albedo), 1 + ply_gain * t * t);
  // (2 t - 1) x^2 + (1 - t) (1 + sent) x - sent = 0: the root that is not above 1.
  const double half = 0.5 * (1 - t) * (1 + sent);
  return std::min(1.0, sent / (half + std::sqrt(half * half + (2 * t - 1) * sent)));
}

inline V3d ply_wall_albedo(const V3d& albedo, double t) {
  return {ply_wall_albedo(albedo.x, t), ply_wall_albedo(albedo.y, t), ply_wall_albedo(albedo.z, t)};
}

}  // namespace selvedge
