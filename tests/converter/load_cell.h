// Cells and stitches of smooth tubes, in one call: their surface and light have closed forms, and they are
// quick to bake. Shared by tests and benchmarks.
#pragma once

#include "converter/stitch/find_cell.h"

namespace selvedge {

/// The settings, of tubes unless they say otherwise.
inline StitchSettings of_tubes(StitchSettings settings = {}) {
  settings.emplace("yarn", std::vector<double>{0});
  return settings;
}

/// Tubes; plain weave is square, its yarns touch their neighbours.
inline StitchSettings tubes_of(const std::string& name) {
  if (name != "plain-weave") return of_tubes();
  return of_tubes({{"warp_spacing_mm", {1}}, {"warp_radius_mm", {0.3}}, {"weft_radius_mm", {0.3}}});
}

/// The mesh alone.
inline Result<CellMesh> load_cell(const std::string& name_or_path, const MeshImportOptions& import = {}) {
  bool built_in = false;
  for (const StitchInfo& info : built_in_stitches()) built_in = built_in || info.name == name_or_path;
  auto cell = find_cell(name_or_path, {import, built_in ? tubes_of(name_or_path) : StitchSettings()});
  if (!cell) return tl::unexpected(cell.error());
  return std::move(cell->mesh);
}

inline StitchPattern plain_knit() { return find_stitch("plain-knit", of_tubes()).value().pattern; }
inline StitchPattern plain_weave() {
  return find_stitch("plain-weave", tubes_of("plain-weave")).value().pattern;
}

}  // namespace selvedge
