#include "converter/cell_source.h"

#include <algorithm>
#include <filesystem>

#include "converter/stitch_library.h"

namespace selvedge {

Result<CellMesh> load_cell(const std::string& name_or_path, const MeshOptions& mesh,
                           const MeshImportOptions& import) {
  const auto infos = built_in_stitches();
  const bool built_in = std::any_of(infos.begin(), infos.end(),
                                    [&](const StitchInfo& info) { return info.name == name_or_path; });
  std::string ending = std::filesystem::path(name_or_path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  // What has no ending was meant as a name: its error lists the names.
  if (!built_in && !ending.empty() && ending != ".json") return read_mesh(name_or_path, import);
  const auto pattern = find_stitch(name_or_path);
  if (!pattern) return tl::unexpected(pattern.error());
  if (import.period) {
    return fail(Code::option_out_of_range, name_or_path, "--period", "a stitch has its own period");
  }
  auto cell = mesh_stitch(*pattern, mesh);
  if (!cell) cell.error().file = name_or_path;
  return cell;
}

}  // namespace selvedge
