// Stage "mesh": stitch pattern -> triangle mesh of one cell (Daubert et al. 2001, section 4: implicit
// surfaces around Bézier skeletons, polygonised by Marching Cubes).
#pragma once

#include <optional>

#include "converter/mesh/cell_mesh.h"
#include "converter/mesh/yarn_chain.h"
#include "converter/stitch/pattern.h"

namespace selvedge {

struct MeshOptions {
  /// Cubes of the grid along the longer period, 4 to 1024. Default: 40, or more so that the radius of the
  /// thinnest yarn (or ply) has 4 cubes; fewer, down to 1.25 cubes, if the mesh would have more than about
  /// 29,000 triangles.
  std::optional<int> cubes_across{};
  int repeats =
      1;  ///< each way, that the pattern holds: by default, each gets as many triangles as one alone
  bool has_yarns = true;  ///< false: without CellMesh::yarns, its places and hairs
};

/// Whether the surface alone has whole yarns in place of so many plies, and fewer sides.
bool hides_plies(const StitchPattern& pattern, const MeshOptions& options);

/// The surface of the yarns in one cell, cut exactly at its walls: a vertex on the wall x = period.x has the
/// same y, z, normal and albedo, to the bit, as its twin on x = 0, and the cut edges of both walls match one
/// to one; the same holds in y. So repeated copies of the mesh have no seams or overlaps. Vertices lie within
/// 0.01 grid edges of the surface (marching_cubes.h). Normals are the function's gradient, albedo is the
/// nearest yarn's; if any yarn is glossy, fibres follow the nearest yarn or ply, turned by the twist of a
/// round yarn; if any has fibres, hairs or irregularity, vertices have their places on yarns, and hairs stand
/// off it. z is the pattern's. Refuses an invalid pattern, cubes_across out of range, and a
/// grid too coarse for its thinnest yarn (less than two cubes to the diameter) or of more than 2^24 points.
Result<CellMesh> mesh_stitch(const StitchPattern& pattern, const MeshOptions& options = {});

/// The yarns alone, with their strands and hairs. Refuses what mesh_stitch() does, but for the grid.
Result<YarnCell> yarn_cell_of(const StitchPattern& pattern);

/// The yarns as a fabric file holds them: curves, nodes and counts of stations (append_chain()); no light
/// yet. Heights are the pattern's own. Yarns of several plies are one curve, or one a ply where the plies
/// turn more often than a file can say or pass a bend so close that they stand still. Refuses patterns as
/// lay_plies() does. Precondition: a valid pattern.
/// Chains of many nodes lie farther from their yarns, as a viewer's memory grows with them; plies that a
/// file has no room for get fewer pieces.
Result<YarnData> yarn_curves_of(const StitchPattern& pattern, const YarnChainOptions& options = {});

/// Hairs that the yarn's hairiness asks for.
double expected_hairs(const Yarn& yarn);
/// Takes away hairs that a file has no room for; returns the fraction that is kept. Throws Failure.
double cut_hairs(StitchPattern& pattern);

}  // namespace selvedge
