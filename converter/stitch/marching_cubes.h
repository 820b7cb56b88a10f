// Marching Cubes over a grid that repeats in x and y: an implicit function -> triangles that tile.
//
// The cases are derived from the signs of the corners: on each face of a cube the contour separates inside
// corners, which depends on that face's four signs alone. So two cubes agree on the face they share, and the
// surface has no cracks; closed contours are then filled with triangles.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

/// The cells of one period. x and y span [0, period]; z spans [z_min, z_min + cells.z * z_step].
struct MarchingGrid {
  V2d period{1, 1};
  V3i cells{1, 1, 1};
  double z_min = 0;
  double z_step = 1;
};

struct MarchedSurface {
  std::vector<V3d> positions;
  /// Per vertex: the vertex on the wall x = 0 or y = 0 of which it is a copy (itself elsewhere). A copy has
  /// the same bits in each coordinate, except those that are exactly the period instead of 0.
  std::vector<int> source_vertex;
  /// Counter-clockwise seen from outside (where the function is positive), with three different vertices.
  std::vector<V3i> triangles;
};

/// Minimum distance of a vertex from a grid point, in grid edges, which prevents triangles without area.
/// Vertices that it moves are at most this far from the surface, all others at most 1e-9.
constexpr double edge_margin = 0.01;

/// Polygonises function < 0. The function is evaluated within one period only; values at the far walls are
/// those at 0. The surface is left open at the lowest and the highest plane of the grid. Precondition: at
/// least one cell each way, fewer than 2^24 grid points.
MarchedSurface marching_cubes(const MarchingGrid& grid, const std::function<double(const V3d&)>& function);

/// The triangles of one of the 256 cases: bit c of `inside` is corner c, at (c & 1, c >> 1 & 1, c >> 2 & 1).
/// Three edges each, counter-clockwise from outside. Edge e runs along axis e / 4 from
/// corner edge_corner(e). No side of a triangle lies within a face of the cube unless it is part of the
/// contour there: two cubes never put the same diagonal into one face.
std::span<const std::array<int, 3>> triangles_of(unsigned inside);
int edge_corner(int edge);

}  // namespace selvedge
