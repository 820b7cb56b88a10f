// Where a cell's mesh comes from: a built-in stitch, a stitch description, or somebody else's mesh.
#pragma once

#include <string>

#include "converter/mesh.h"
#include "converter/mesh_file.h"
#include "converter/stitch_mesh.h"

namespace selvedge {

/// The mesh of one cell from a built-in stitch's name ("plain-knit"), a stitch description (a path ending in
/// .json) or a mesh file (any other path). `mesh` counts for stitches, `import` for mesh files;
/// a period given for a stitch is refused.
Result<CellMesh> load_cell(const std::string& name_or_path, const MeshOptions& mesh = {},
                           const MeshImportOptions& import = {});

}  // namespace selvedge
