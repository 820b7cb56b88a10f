// Reflections of an environment by materials without a fabric, as a split sum (Karis 2013): the environment
// seen in mirrors of every roughness, times the fraction of even light that a surface reflects.
#pragma once

#include <vector>

#include "format/picture/environment.h"

namespace selvedge {

/// Radiance under GGX lobes, the cosine to the light included, as if the view were along the normal.
struct Reflections {
  std::vector<Environment> levels;  ///< the first of a mirror, the last of roughness 1, in equal steps

  /// Towards `direction` (unit, world), which a view is mirrored to; roughness in [0, 1].
  V3f at(const V3d& direction, float roughness) const;
};

/// Sums over all pixels, in half a processor second for a picture of 1024 x 512.
Reflections reflections_of(const Environment& environment);

/// The specular part of pbr_brdf() under even light of radiance 1 is f0 * x + y, by roughness and cosine to
/// the viewer, both from 0 to 1; interpolated from a table.
V2f environment_brdf(float roughness, float cosine);

}  // namespace selvedge
