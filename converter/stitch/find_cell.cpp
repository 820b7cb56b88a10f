#include "converter/stitch/find_cell.h"

#include <algorithm>
#include <array>
#include <filesystem>

#include "converter/mesh/map_joints.h"
#include "converter/stitch/blocking.h"
#include "converter/stitch/text_fault.h"
#include "converter/stitch/wif.h"
#include "converter/stitch/yarn_mesh.h"
#include "format/base/input_file.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

bool is_built_in(const std::string& name) {
  const auto infos = built_in_stitches();
  return std::ranges::any_of(infos, [&](const StitchInfo& info) { return info.name == name; });
}

/// Whether a file begins as a draft does, whatever its name is.
bool begins_as_draft(const std::string& path) {
  const auto file = InputFile::open(path);
  std::array<std::uint8_t, 4096> head{};
  const std::size_t size = file ? std::min<std::size_t>(file->size(), head.size()) : 0;
  return size > 0 && file->read(0, std::span(head).first(size)) &&
         is_wif({reinterpret_cast<const char*>(head.data()), size});
}

}  // namespace

bool is_stitch(const std::string& name_or_path) {
  // Without an ending it must be a name: the error of find_stitch() lists the names.
  return is_built_in(name_or_path) || std::filesystem::path(name_or_path).extension().empty() ||
         has_ending(name_or_path, ".json") || has_ending(name_or_path, ".wif") ||
         has_ending(name_or_path, ".txt") || has_ending(name_or_path, ".png") ||
         begins_as_draft(name_or_path);
}

Result<Cell> find_cell(const std::string& name_or_path, const CellOptions& options) {
  return catch_failure([&]() -> Result<Cell> {
    Cell cell;
    if (!is_stitch(name_or_path)) {
      if (!options.settings.empty())
        return fail(Code::option_out_of_range, name_or_path, "--set", "a mesh has no parameters");
      cell.choices.emplace();
      cell.mesh = value_or_throw(read_mesh(name_or_path, options.import, &*cell.choices));
      cell.remarks = remarks_on(*cell.choices);
      return cell;
    }
    StitchSettings settings = options.settings;
    if (const auto& period = options.import.period) {
      const auto info = value_or_throw(describe_stitch(name_or_path));
      const auto refuse = [&](const char* why) {
        return fail(Code::option_out_of_range, name_or_path, "--period", why);
      };
      if (!set_blocked_size(*period, settings)) return refuse("excludes width_mm and height_mm");
      if (std::ranges::find(info.parameters, "width_mm", &StitchParameter::name) == info.parameters.end())
        return refuse("is for knits and meshes");
    }
    cell.stitch = value_or_throw(find_stitch(
        name_or_path, settings, options.on_start,
        [&](const StitchPattern& drawn, RelaxOptions relaxation) {
          relaxation.progress = options.progress;
          return default_relaxer(drawn, relaxation);
        },
        options.kinds));
    const StitchPattern& pattern = cell.stitch->pattern;
    const bool is_surface = options.form == StitchForm::surface;
    if (options.form == StitchForm::mesh || is_surface)
      cell.mesh = value_or_throw(
          with_file_name(name_or_path, [&] { return value_or_throw(mesh_stitch(pattern, !is_surface)); }));
    else if (options.form == StitchForm::yarn)
      cell.yarn = value_or_throw(with_file_name(name_or_path, [&] {
        YarnCell yarn = value_or_throw(yarn_cell_of(pattern));
        if (const auto& arranged = cell.stitch->arranged)
          value_or_throw(
              set_map(yarn, arranged->map, yarns_of_rows(arranged->sampler), cell.stitch->part_begins));
        return yarn;
      }));
    cell.remarks = cell.stitch->remarks;
    if (is_surface && hides_plies(pattern))
      cell.remarks.emplace_back("so many plies have no room in a mesh: its yarns are drawn whole");
    return cell;
  });
}

std::vector<std::string> files_of_cell(const std::string& name_or_path) {
  if (is_built_in(name_or_path) || std::filesystem::path(name_or_path).extension().empty()) return {};
  std::vector<std::string> files{name_or_path};
  if (!is_stitch(name_or_path))
    for (std::string& file : material_files_of(name_or_path)) files.push_back(std::move(file));
  return files;
}

}  // namespace selvedge
