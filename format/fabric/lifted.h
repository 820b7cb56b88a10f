// Directions as rays through yarn take them (spec/brdf.md, "Yarn").
#pragma once

#include <algorithm>

#include "format/base/vec.h"

namespace selvedge {

/// Minimum rise of views and lights per unit of length in the plane, which bounds a ray's length.
inline constexpr float min_ray_rise = 1.0F / 32;

/// Radii above the surface at which light leaves it: more than a chain's corners stand out.
inline constexpr float surface_offset_radii = 1.0F / 64;

/// Normals that face the viewer less than this are taken to face him this much.
inline constexpr float min_facing_cosine = 0.01F;

/// The unit direction `d`, raised to that where it is lower.
inline V3f clamp_rise(const V3f& d) { return V3f(d.x, d.y, std::max(d.z, min_ray_rise)).normalized(); }

}  // namespace selvedge
