// Flat patterns: panels of a garment laid into the plane with as little stretch as possible.
#pragma once

#include <vector>

#include "format/base/vec.h"

namespace selvedge {

/// One panel: a disc (one boundary loop) of triangles, counter-clockwise seen from outside; metres.
struct ClothPanel {
  std::vector<V3d> positions;
  std::vector<V3i> triangles;
};

/// Lays a panel flat: a plane position per vertex, in metres, triangles counter-clockwise. The least-squares
/// conformal map is the start, then as-rigid-as-possible (Liu et al. 2008, "A Local/Global Approach to Mesh
/// Parameterization"). Position and rotation are arbitrary. Precondition: every triangle has an area.
std::vector<V2d> flatten(const ClothPanel& panel);

/// The mean over the area of the gradient in the plane of how far a point lies along `direction`, times twice
/// the area.
V2d area_weighted_gradient(const ClothPanel& panel, const std::vector<V2d>& plane, const V3d& direction);

/// For each position the index of the first one that is no farther along any axis than `tolerance`.
std::vector<std::uint32_t> weld(const std::vector<V3d>& positions, double tolerance = 0);

}  // namespace selvedge
