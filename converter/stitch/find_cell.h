// Where a cell's mesh comes from: a built-in stitch, a stitch description, a weaving draft, or somebody
// else's mesh.
#pragma once

#include <optional>
#include <string>

#include "converter/mesh/cell_mesh.h"
#include "converter/mesh/file.h"
#include "converter/stitch/library.h"
#include "converter/stitch/yarn_mesh.h"

namespace selvedge {

struct CellOptions {
  MeshOptions mesh;          ///< counts for stitches
  MeshImportOptions import;  ///< counts for mesh files; a period given for a stitch is refused
  StitchSettings settings;   ///< of a stitch's parameters; refused for mesh files
};

struct Cell {
  CellMesh mesh;
  std::optional<FoundStitch> stitch;   ///< what a mesh was made of
  std::optional<MeshChoices> choices;  ///< of a mesh file
};

/// The mesh of one cell from a built-in stitch's name ("plain-knit"), a stitch description (a path ending in
/// .json), a weaving draft (.wif) or a mesh file (any other path).
Result<Cell> find_cell(const std::string& name_or_path, const CellOptions& options = {});

}  // namespace selvedge
