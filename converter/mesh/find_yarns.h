// Finds the yarns that a mesh shows: for meshes from files, which hold triangles alone.
#pragma once

#include "converter/mesh/cell_mesh.h"

namespace selvedge {

struct FoundYarns {
  YarnData yarns;  ///< without light; heights as in the mesh
  /// Fraction of the surface's area that lies within 0.1 radii of the round tube about the nearest curve,
  /// faces as it does, and has its albedo to within 0.1.
  double explained_fraction = 0;
};

/// Yarns or plies that are round tubes of one radius and closed in the repeat, also where they touch and
/// their meshes are joined. Points of the surface give the balls that touch it from inside; in tubes the
/// centres of these lie on the axis, which is then walked along, and moved until the surface lies at one
/// distance about it. Open ends, yarns of other sections, and sheets are left out. A curve's albedo is the
/// mean over its surface. The same mesh gives the same yarns for any number of threads. Precondition:
/// validate(mesh, name) holds.
FoundYarns find_yarns(const CellMesh& mesh);

}  // namespace selvedge
