// The yarn of one repeating cell, without a mesh.
#pragma once

#include <vector>

#include "converter/mesh/cell_mesh.h"

namespace selvedge {

struct YarnCell {
  V2d period{1, 1};  ///< mm
  YarnData yarns;    ///< without light; heights above the lowest point
  std::vector<V3f>
      wall_transmission;  ///< of each curve: fraction of matt light that goes through the wall of a ply
  double thickness = 0;   ///< mm, without hairs
};

/// The same of a mesh with yarns. Precondition: validate() holds of it.
YarnCell yarn_cell_of(const CellMesh& mesh);

/// Moves the yarns so that their lowest point lies at height 0, and sets the thickness. Precondition:
/// validate() holds of them.
void move_to_ground(YarnCell& cell);

}  // namespace selvedge
