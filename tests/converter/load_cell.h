// Cells and stitches with their defaults, in one call. Shared by tests and benchmarks.
#pragma once

#include "converter/stitch/find_cell.h"

namespace selvedge {

/// The mesh alone.
inline Result<CellMesh> load_cell(const std::string& name_or_path, const MeshOptions& mesh = {},
                                  const MeshImportOptions& import = {}) {
  auto cell = find_cell(name_or_path, {mesh, import, {}});
  if (!cell) return tl::unexpected(cell.error());
  return std::move(cell->mesh);
}

inline StitchPattern plain_knit() { return find_stitch("plain-knit").value().pattern; }
inline StitchPattern plain_weave() { return find_stitch("plain-weave").value().pattern; }

}  // namespace selvedge
