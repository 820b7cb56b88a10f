// The outline of curved cloth: a ray that only grazes it leaves again before it has reached the yarn's depth.
//
// Cloth of curvature c lies c s^2 / 2 below its tangent plane at the distance s. A ray that passes the plane
// with the slope m gets no deeper into it than m^2 / (2 c): there it turns back (quadric silhouettes,
// Oliveira and Policarpo 2005). Yarn further below is not met: the pixel shows what lies behind, and the
// outline is the yarn's. The ray itself stays straight, so that nothing else moves where the curvature of
// the mesh jumps.
#pragma once

#include <array>

#include "format/base/vec.h"

namespace selvedge {

/// How far below the plane a ray gets, mm; infinite where the cloth does not bend away from the viewer.
/// `view`: unit, in the frame of the cloth. `curvature`: 1/mm, of the front, along the view. `thickness`: mm,
/// of the yarn below the plane; cloth is taken to bend by four times that at most, as folds tighter than that
/// are no surface to which yarn is small.
float grazing_depth(const V3f& view, float curvature, float thickness);

/// Whether yarn so far below the plane of the visible side (1: front, -1: back) is met; mm. Of yarn that is
/// turned over, the deep one lies above.
inline bool is_met(float below, float depth, float side) {
  return below <= depth && (side > 0 || below >= -depth);
}

/// A triangle of cloth: texture coordinates, and normals of the front, not all unit.
struct CurvedTriangle {
  std::array<V2f, 3> uv;
  std::array<V3f, 3> normals;
};

/// Curvature along unit `along`, world axes, which is `across` on the cloth: mm of a repeat of `period` mm,
/// x along growing u, y along falling v. `normal_length`: of the interpolated normal. 0 for a triangle
/// without texture coordinates of its own.
float curvature_along(const CurvedTriangle& triangle, const V2f& period, const V2f& across, const V3f& along,
                      float normal_length);

}  // namespace selvedge
