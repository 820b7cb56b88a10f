// Finds or makes a cell's mesh: from a built-in stitch, a stitch description, a weaving draft, a
// knitting chart, or a mesh file.
#pragma once

#include <optional>
#include <string>

#include "converter/mesh/cell_mesh.h"
#include "converter/mesh/file.h"
#include "converter/stitch/library.h"

namespace selvedge {

/// Form in which a stitch is wanted: a mesh with all that light needs, its surface alone, its yarn alone, or
/// its pattern.
enum class StitchForm { mesh, surface, yarn, pattern };

struct CellOptions {
  MeshImportOptions import;     ///< used for mesh files; a period of a knit is what it is blocked to
  StitchSettings settings;      ///< of a stitch's parameters; refused for mesh files
  StartCallback on_start = {};  ///< called before the yarns of a chart or draft are laid
  Progress progress = {};       ///< of relaxation
  StitchForm form = StitchForm::mesh;
  KindLimit kinds = {};  ///< of StitchForm::yarn: how much of a chart or draft is made
};

struct Cell {
  CellMesh mesh;                       ///< empty of StitchForm::yarn and pattern
  std::optional<YarnCell> yarn;        ///< of StitchForm::yarn
  std::optional<FoundStitch> stitch;   ///< that it was made of
  std::optional<MeshChoices> choices;  ///< of a mesh file
  std::vector<std::string> remarks;    ///< choices, guesses and omissions, one line each
};

/// Whether find_cell() takes this for a stitch, draft or chart, not for a mesh file.
bool is_stitch(const std::string& name_or_path);

/// The mesh of one cell from a built-in stitch's name ("plain-knit"), a stitch description (a path ending in
/// .json), a weaving draft (.wif, or by its beginning), a knitting chart (.txt or .png) or a mesh file (any
/// other path).
Result<Cell> find_cell(const std::string& name_or_path, const CellOptions& options = {});

/// The files that find_cell() reads: none for a built-in stitch, else the path, and the material files that
/// an OBJ file names and that are there.
std::vector<std::string> files_of_cell(const std::string& name_or_path);

}  // namespace selvedge
