#include "apps/selvedge-view/idle_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "format/base/option_text.h"

namespace selvedge {
namespace {

struct Idle {
  bool here;
  const char* why;
  std::vector<const char*> options;
};

/// Whether there are lights whose axes --light-frame names.
bool any_far_away(const std::vector<Light>& lights) {
  return std::any_of(lights.begin(), lights.end(),
                     [](const Light& light) { return light.kind == LightKind::directional; });
}

std::string first_of(const std::vector<Idle>& all, const std::function<bool(const char*)>& given) {
  for (const Idle& idle : all) {
    for (const char* option : idle.options) {
      if (idle.here && given(option)) return fmt::format("{} {}", option, idle.why);
    }
  }
  return {};
}

/// A parallel camera shows everything, or what a perspective one shows at the distance.
Idle field_of_view(const CameraOptions& camera) {
  return {camera.projection == Projection::parallel && !camera.distance,
          "counts for nothing with --orthographic, without --distance",
          {"--fov"}};
}

Idle distance_factor(const CameraOptions& camera) {
  return {camera.distance.has_value(), "counts for nothing with --distance", {"--distance-factor"}};
}

Idle shadows(const std::string& input) {
  return {has_ending(input, ".exr"), "counts for nothing with a swatch, which is flat", {"--shadows"}};
}

Idle light_frame(const std::vector<Light>& lights) {
  return {!any_far_away(lights), "counts for nothing without --light", {"--light-frame"}};
}

}  // namespace

std::string idle_option(const RenderCommand& command, const std::function<bool(const char*)>& given) {
  const bool swatch = has_ending(command.input, ".exr");
  const std::vector<Idle> all{
      {swatch,
       "is for scenes, not for a swatch",
       {"--azimuth", "--elevation", "--fov", "--distance", "--distance-factor", "--look-at", "--zoom",
        "--focus", "--camera", "--scene", "--variant", "--orthographic", "--turntable", "--compare",
        "--layers", "--ambient"}},
      shadows(command.input),
      light_frame(command.lights),
      {!command.camera_of_file.empty(),
       "counts for nothing with --camera",
       {"--azimuth", "--elevation", "--fov", "--orthographic", "--distance", "--distance-factor",
        "--look-at"}},
      field_of_view(command.camera),
      distance_factor(command.camera),
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
  return first_of(all, given);
}

std::string idle_option(const ShowCommand& command, const std::function<bool(const char*)>& given) {
  return first_of({shadows(command.input), light_frame(command.lights), field_of_view(command.camera),
                   distance_factor(command.camera)},
                  given);
}

}  // namespace selvedge
