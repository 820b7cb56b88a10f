#include <fmt/format.h>

#include "apps/selvedge/commands.h"
#include "apps/selvedge/report.h"

namespace selvedge {

int run(const DressCommand& command) {
  apply(command.common);
  const auto dressed = dress(command.garment, command.fabric, command.output, command.dress);
  if (!dressed) return report_error(dressed.error());
  for (const std::string& warning : dressed->warnings) {
    if (!command.common.quiet) report_remark(command.garment, warning);
  }
  Json materials = Json::array();
  std::string text;
  for (const DressedMaterial& m : dressed->materials) {
    materials.push_back({{"index", m.index},
                         {"name", m.name},
                         {"primitives", m.primitives},
                         {"metresPerUv", {m.metres_per_uv.x, m.metres_per_uv.y}},
                         {"repeats", {m.repeats.x, m.repeats.y}},
                         {"spread", {m.spread.x, m.spread.y}}});
    text += fmt::format(
        "#{} {}: {} primitives, {:.4g} x {:.4g} m per unit of uv, {:.5g} x {:.5g} repeats, spread {:.1f} % x "
        "{:.1f} %\n",
        m.index, m.name, m.primitives, m.metres_per_uv.x, m.metres_per_uv.y, m.repeats.x, m.repeats.y,
        100 * m.spread.x, 100 * m.spread.y);
  }
  text += fmt::format("fabric {}, tangents added to {} primitives -> {} ({} bytes)\n",
                      dressed->embedded ? "embedded" : "beside", dressed->tangents_added, command.output,
                      dressed->bytes);
  for (const std::string& file : dressed->usd_files) text += fmt::format("USD: {}\n", file);
  report(command.common, "dress",
         {{"output", command.output},
          {"bytes", dressed->bytes},
          {"embedded", dressed->embedded},
          {"usd", dressed->usd_files},
          {"tangentsAdded", dressed->tangents_added},
          {"materials", materials},
          {"warnings", dressed->warnings}},
         text);
  return 0;
}

}  // namespace selvedge
