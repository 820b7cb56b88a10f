#include "viewer/render_checks.h"

#include <fmt/format.h>

#include "viewer/hybrid/layers.h"
#include "viewer/light/shadows.h"
#include "viewer/paper/limits.h"

namespace selvedge {

Result<void> check_paper(const RenderOptions& look) {
  if (look.levels.linear || look.levels.taps > 1 || look.levels.bias != 0)
    return fail(Code::option_out_of_range, "",
                !look.levels.linear && look.levels.taps > 1 ? "--anisotropy" : "--filter",
                "the paper's path takes one texel of a level, the nearest, and OpenGL's level as it is");
  if (look.shadows > 0)
    return fail(Code::option_out_of_range, "", "--shadows",
                "the paper's frames do not have the pixel's place, which shadows need: take --path hybrid");
  return check_paper_lights(look.lights);
}

Result<void> check_options(const RenderOptions& o) {
  const auto refuse = [](const char* option, std::string reason) -> Result<void> {
    return fail(Code::option_out_of_range, "", option, std::move(reason));
  };
  if (o.supersample < 1 || o.supersample > 16) return refuse("--supersample", "must lie between 1 and 16");
  const int limit = index_pass_side_limit / o.supersample;
  if (o.width < 1 || o.height < 1 || o.width > limit || o.height > limit)
    return refuse("--size", fmt::format("must lie between 1x1 and {0}x{0}", limit));
  if (o.layers < 1 || o.layers > max_layers)
    return refuse("--layers", fmt::format("must lie between 1 and {}", max_layers));
  if (o.levels.forced < -1) return refuse("--level", "must not be negative");
  const int taps = tap_limit(o.levels.linear);
  if (o.levels.taps < 1 || o.levels.taps > taps)
    return refuse("--anisotropy", fmt::format("must lie between 1 and {}{}", taps,
                                              o.levels.linear ? " with --filter linear" : ""));
  if (o.path == RenderPath::shader && o.power != PowerKind::exact)
    return refuse("--power", "is the processor's; with --path shader OpenGL computes its own powers");
  if (o.path == RenderPath::paper) return check_paper(o);
  return {};
}

Result<void> check_shadows(const RenderOptions& o) {
  if (o.shadows == 0 || (o.shadows >= min_shadow_size && o.shadows <= max_shadow_size)) return {};
  return fail(Code::option_out_of_range, "", "--shadows",
              fmt::format("must lie between {} and {}", min_shadow_size, max_shadow_size));
}

Result<void> check_fabrics(const Scene& scene, const std::vector<Fabric>& fabrics) {
  for (std::size_t i = 0; i < fabrics.size(); ++i) {
    const std::vector<FabricLevel>& levels = fabrics[i].levels;
    const std::string name = i < scene.fabrics.size() ? scene.fabrics[i].name : "";
    if (levels.empty()) return fail(Code::fabric_malformed, name, "", "the fabric has no level");
    for (std::size_t k = 0; k < levels.size(); ++k) {
      const auto step = static_cast<int>(k);
      if (levels[k].width != level_size(levels[0].width, step) ||
          levels[k].height != level_size(levels[0].height, step))
        return fail(Code::fabric_malformed, name, fmt::format("level {}", k),
                    "its size does not follow from level 0");
    }
    if (levels.size() > static_cast<std::size_t>(level_count(levels[0].width, levels[0].height)))
      return fail(Code::fabric_malformed, name, "", "there are more levels than sizes");
  }
  return {};
}

}  // namespace selvedge
