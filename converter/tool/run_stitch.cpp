#include <fmt/format.h>

#include <filesystem>

#include "converter/cell_source.h"
#include "converter/stitch_json.h"
#include "converter/stitch_library.h"
#include "converter/tool/commands.h"
#include "converter/tool/report.h"
#include "format/atomic_file.h"

namespace selvedge {
namespace {

int list_stitches(const StitchCommand& command) {
  Json list = Json::array();
  std::string text;
  for (const StitchInfo& info : built_in_stitches()) {
    list.push_back({{"name", info.name}, {"description", info.description}});
    text += fmt::format("{:14} {}\n", info.name, info.description);
  }
  report(command.common, "stitch", {{"stitches", list}}, text);
  return 0;
}

int write_description(const StitchCommand& command) {
  const auto pattern = find_stitch(command.input);
  if (!pattern) return report_error(pattern.error());
  if (auto ok = write_file(command.output, to_json(*pattern)); !ok) return report_error(ok.error());
  report(command.common, "stitch", {{"stitch", pattern->name}, {"output", command.output}},
         fmt::format("{}: {} yarns -> {}\n", pattern->name, pattern->yarns.size(), command.output));
  return 0;
}

}  // namespace

int run(const StitchCommand& command) {
  if (command.list) return list_stitches(command);
  const std::string ending = std::filesystem::path(command.output).extension().string();
  if (ending == ".json") return write_description(command);
  const auto mesh = load_cell(command.input, command.mesh, command.import);
  if (!mesh) return report_error(mesh.error());
  if (!command.output.empty()) {
    if (auto ok = write_mesh(command.output, *mesh); !ok) return report_error(ok.error());
  }
  const Box box = bounds_of(*mesh);
  const float height = box.max.z - box.min.z;
  report(command.common, "stitch",
         {{"stitch", command.input},
          {"vertices", mesh->positions.size()},
          {"triangles", mesh->triangles.size()},
          {"periodMm", {mesh->period.x, mesh->period.y}},
          {"thicknessMm", height},
          {"output", command.output}},
         fmt::format("{}: {} vertices, {} triangles, {:g} x {:g} mm, {:.3g} mm thick{}\n", command.input,
                     mesh->positions.size(), mesh->triangles.size(), mesh->period.x, mesh->period.y, height,
                     command.output.empty() ? "" : " -> " + command.output));
  return 0;
}

}  // namespace selvedge
