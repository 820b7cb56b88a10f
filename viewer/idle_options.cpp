#include "viewer/idle_options.h"

#include <fmt/format.h>

#include <vector>

#include "format/option_text.h"

namespace selvedge {

std::string idle_option(const RenderCommand& command, const std::function<bool(const char*)>& given) {
  struct Idle {
    bool here;
    const char* why;
    std::vector<const char*> options;
  };
  const bool swatch = has_ending(command.input, ".exr");
  const std::vector<Idle> all{
      {swatch,
       "is for scenes, not for a swatch",
       {"--azimuth", "--elevation", "--fov", "--distance", "--distance-factor", "--look-at", "--zoom",
        "--focus", "--camera", "--scene", "--variant", "--orthographic", "--turntable", "--compare",
        "--layers", "--ambient"}},
      {!swatch, "is for fabrics, not for a scene", {"--place", "--repeats", "--view", "--pixels-per-texel"}},
      {command.place.has_value(),
       "counts for nothing with --place",
       {"--repeats", "--view", "--pixels-per-texel"}},
      {swatch && !command.place,
       "counts for nothing with a swatch of whole texels, without --place",
       {"--size"}},
      {command.render.levels.forced >= 0,
       "counts for nothing with --level, which shows the nearest texels of one level",
       {"--filter", "--anisotropy", "--level-blend"}},
      {command.render.path == RenderPath::paper,
       "counts for nothing with --path paper, which draws fabrics alone",
       {"--ambient"}},
      {command.render.path == RenderPath::shader,
       "counts for nothing with --path shader: OpenGL has its own powers",
       {"--power"}},
  };
  for (const Idle& idle : all) {
    for (const char* option : idle.options) {
      if (idle.here && given(option)) return fmt::format("{} {}", option, idle.why);
    }
  }
  return {};
}

}  // namespace selvedge
