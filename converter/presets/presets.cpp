#include "converter/presets/presets.h"

namespace selvedge {

std::optional<MakeOptions> preset_named(std::string_view name) {
  if (name == "paper") return MakeOptions();
  for (const Preset& preset : presets) {
    if (preset.name != name) continue;
    MakeOptions options = with_knobs(preset.knobs);
    options.budget_texels = options.budget ? options.bake.width * options.bake.height : 0;
    return options;
  }
  return std::nullopt;
}

}  // namespace selvedge
