// Stage "mesh": stitch pattern -> triangle mesh of one cell (Daubert et al. 2001, section 4: implicit
// surfaces around Bézier skeletons, polygonised by Marching Cubes).
#pragma once

#include <string>

#include "converter/mesh.h"
#include "converter/stitch.h"

namespace selvedge {

struct MeshOptions {
  int cells_across = 40;  ///< cubes of the grid along the longer period, 4 to 1024
};

/// The yarns' surface of one cell, cut exactly at its walls: a vertex on the wall x = period.x has the same
/// y, z, normal and albedo, to the bit, as its twin on x = 0, and the walls' cut edges match one to one; the
/// same in y. Copies of the mesh, a period apart, close without seam or overlap. Vertices lie within
/// 0.01 grid edges of the surface (marching_cubes.h). Normals are the function's gradient, albedo is that of
/// the nearest yarn. z is the pattern's own.
/// Refuses an invalid pattern, cells_across out of range, and a grid too coarse for its thinnest yarn (less
/// than two cubes to the diameter) or of more than 2^24 points.
Result<CellMesh> mesh_stitch(const StitchPattern& pattern, const MeshOptions& options = {});

}  // namespace selvedge
