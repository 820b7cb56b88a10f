// Fuzz: hairs that stand off the yarns of a mesh.
#pragma once

#include "converter/mesh/cell_mesh.h"

namespace selvedge {

/// The hairs of mesh.yarns (format/fabric/yarn_hairs.h), each from the triangle of the mesh that lies nearest
/// to its root. Precondition: triangles lie in the cell.
Hairs grow_hairs(const CellMesh& mesh);

}  // namespace selvedge
