// Measures a garment's texture coordinates: metres of cloth per unit of UV.
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "format/scene/scene.h"

namespace selvedge {

struct UvSize {
  V2d metres{0, 0};    ///< along u and v, per unit of UV
  V2d smallest{0, 0};  ///< of the primitives' own medians
  V2d largest{0, 0};
  int primitives = 0;  ///< instances with area in space and in UV
};

/// Medians of |dP/du| and |dP/dv| over all triangles of the given primitives in world space (with node
/// scales), weighted by area. Medians are robust against slivers with nearly no UV area, which would dominate
/// a mean. `chosen` holds indices into scene.primitives.
UvSize measure_uv(const Scene& scene, const std::set<int>& chosen, int tex_coord);

}  // namespace selvedge
