#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/selvedge/commands.h"
#include "apps/selvedge/report.h"

namespace selvedge {

int run(const ReattachCommand& command) {
  apply(command.common);
  const auto restored = reattach(command.input, command.output, command.reattach);
  if (!restored) return report_error(restored.error());
  for (const std::string& warning : restored->warnings) {
    if (!command.common.quiet) report_remark(command.input, warning);
  }
  Json materials = Json::array();
  std::string text;
  for (const ReattachedMaterial& m : restored->materials) {
    const UvTransform& t = m.transform;
    materials.push_back({{"index", m.index},
                         {"name", m.name},
                         {"fabric", m.fabric},
                         {"texCoord", m.tex_coord},
                         {"offset", {t.offset.x, t.offset.y}},
                         {"rotation", t.rotation},
                         {"scale", {t.scale.x, t.scale.y}}});
    text += fmt::format("#{} {}: {}, {:.5g} x {:.5g} repeats per unit of uv\n", m.index, m.name, m.fabric,
                        t.scale.x, t.scale.y);
  }
  if (!restored->attached.empty()) {
    text += fmt::format("left alone, with a fabric already: #{}\n", fmt::join(restored->attached, ", #"));
  }
  text += fmt::format("{} fabrics embedded -> {} ({} bytes)\n", restored->embedded, command.output,
                      restored->bytes);
  report(command.common, "reattach",
         {{"output", command.output},
          {"bytes", restored->bytes},
          {"embedded", restored->embedded},
          {"materials", materials},
          {"attached", restored->attached},
          {"warnings", restored->warnings}},
         text);
  return 0;
}

}  // namespace selvedge
