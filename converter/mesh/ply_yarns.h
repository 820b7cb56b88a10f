// The yarns of a cell in PLY files: properties and elements of our own, named "yarn_...".
#pragma once

#include <string>

#include "converter/mesh/cell_mesh.h"
#include "converter/mesh/guesses.h"
#include "format/mesh/ply.h"

namespace selvedge {

/// Adds gloss, fibres and transmission, and of a mesh in the axes and units that it was written in the skins,
/// places, hairs and yarns without their light. FILE_DAMAGED, with the element, for values out of range.
Result<void> add_yarns(const PlyFile& ply, const MeshChoices& choices, const std::string& path,
                       CellMesh& mesh);

/// A binary PLY file with all of a mesh: colours also as 8-bit sRGB for other programs.
std::string write_ply(const CellMesh& mesh, const std::string& comment);

}  // namespace selvedge
