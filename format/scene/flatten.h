// Flat patterns: panels of a garment laid into the plane with as little stretch as possible.
#pragma once

#include <array>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

/// One panel: a disc (one boundary loop) of triangles, counter-clockwise seen from outside; metres.
struct Panel {
  std::vector<V3d> positions;
  std::vector<V3i> triangles;
};

/// A plane position per vertex, in metres, triangles counter-clockwise: least-squares conformal map as the
/// start, then as-rigid-as-possible (Liu et al. 2008, "A Local/Global Approach to Mesh Parameterization").
/// Position and rotation of the result are arbitrary. Precondition: every triangle has an area.
std::vector<V2d> flatten(const Panel& panel);

/// As above, from given plane positions (one per vertex) instead of the conformal map.
std::vector<V2d> relax(const Panel& panel, const std::vector<V2d>& start);

/// The mean over the area of the gradient in the plane of how far a point lies along `direction`, times twice
/// the area.
V2d gradient_of(const Panel& panel, const std::vector<V2d>& plane, const V3d& direction);

/// Metres of surface per unit of the plane within one triangle: the singular values of dP/d(u, v).
struct Stretch {
  double most = 1;
  double least = 1;
};
Stretch stretch_of(const std::array<V3d, 3>& corners, const std::array<V2d, 3>& plane);

}  // namespace selvedge
