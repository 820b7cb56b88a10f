// Marching Cubes over a grid that repeats in x and y: an implicit function -> triangles that tile.
//
// The cases are not a copied table but built from the corners' signs: on each face of a cube the contour
// keeps inside corners apart, which depends on that face's four signs alone, so that two cubes always agree
// on the face they share and the surface has no cracks; closed contours are then filled with triangles.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "format/base/error.h"
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
  /// Per vertex: the vertex on wall x = 0 and y = 0 of which it is the copy (itself anywhere else). A copy's
  /// coordinates are the same bits, save the one or two that are exactly the period instead of exactly 0.
  std::vector<int> original;
  /// Counter-clockwise seen from outside (from where the function is positive). Never a vertex twice.
  std::vector<V3i> triangles;
};

/// Least distance, in edges of the grid, of a vertex from a grid point: keeps triangles from vanishing.
/// A vertex is at most this far from the surface, and 1e-9 otherwise.
constexpr double edge_margin = 0.01;

/// Polygonises function < 0. It is evaluated on x in [0, period.x), y in [0, period.y] of one period only,
/// its values at the walls being taken from 0. Surface that reaches the lowest or the highest plane of the
/// grid is left open there. Precondition: at least one cell each way, fewer than 2^24 grid points.
MarchedSurface march(const MarchingGrid& grid, const std::function<double(const V3d&)>& function);

/// The triangles of one of the 256 cases: bit c of `inside` is corner c, at (c & 1, c >> 1 & 1, c >> 2 & 1).
/// Three edges each, counter-clockwise from outside. Edge e runs along axis e / 4 from
/// corner edge_corner(e). No side of a triangle lies within a face of the cube unless it is part of the
/// contour there: two cubes never put the same diagonal into one face.
std::span<const std::array<int, 3>> triangles_of(unsigned inside);
int edge_corner(int edge);

}  // namespace selvedge
