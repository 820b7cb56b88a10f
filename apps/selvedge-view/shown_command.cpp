#include "apps/selvedge-view/shown_command.h"

#include <fmt/format.h>

#include <algorithm>

#include "format/base/option_text.h"
#include "viewer/show/picture.h"

namespace selvedge {
namespace {

std::string triple(const auto& v) { return fmt::format("{},{},{}", v.x, v.y, v.z); }

bool same(const std::vector<Light>& a, const std::vector<Light>& b) {
  return std::ranges::equal(a, b, [](const Light& x, const Light& y) {
    return x.kind == y.kind && x.direction == y.direction && x.position == y.position &&
           x.irradiance == y.irradiance;
  });
}

}  // namespace

std::string command_of(const std::string& input, const std::vector<Light>& own, const ShowState& state,
                       const V2i& size) {
  std::string line = "selvedge-view render " + shell_word(input);
  const auto add = [&](const char* option, const auto& value) {
    line += fmt::format(" {}={}", option, value);
  };
  const CameraOptions& camera = state.camera;
  add("--size", fmt::format("{}x{}", size.x, size.y));
  add("--azimuth", camera.azimuth);
  add("--elevation", camera.elevation);
  add("--fov", camera.field_of_view);
  add("--look-at", triple(camera.look_at.value_or(V3d(0, 0, 0))));
  add("--distance", camera.distance.value_or(0));
  add("--path", path_names[state.path]);
  if (state.levels.forced >= 0) add("--level", state.levels.forced);
  add("--layers", state.layers);
  // The lights of `render` without options.
  const bool in_environment = state.environment >= 0;
  const bool lamps = own.empty() && !in_environment;
  const bool plain = same(state.lights, lamps ? key_and_fill_lights() : own) &&
                     (state.lights.empty() || state.lights_in_camera_frame == lamps);
  if (!plain) {
    bool in_camera_frame = false;
    for (const Light& light : state.lights) {
      const float strength = std::max({light.irradiance.x, light.irradiance.y, light.irradiance.z});
      if (light.kind == LightKind::directional) {
        add("--light", fmt::format("{},{}", triple(light.direction), strength));
        in_camera_frame = state.lights_in_camera_frame;
      } else {
        add("--point-light", fmt::format("{},{}", triple(light.position), strength));
      }
    }
    if (in_camera_frame) add("--light-frame", "camera");
  }
  if (in_environment) {
    add("--environment", shell_word(state.environments[state.environment]->name));
    add("--environment-turn", state.turn);
    add("--environment-strength", state.strength);
    if (state.backdrop) line += " --backdrop";
    if (state.backdrop) add("--backdrop-blur", state.backdrop_blur);
  } else {
    add("--environment", "none");
  }
  add("--ambient", state.ambient);
  add("--shadows", state.shadows);
  if (camera.projection == Projection::parallel) line += " --orthographic";
  add("--exposure", state.display.exposure);
  add("--tone-map", tone_curve_names[static_cast<std::size_t>(state.display.tone)]);
  add("--background", state.display.background ? triple(*state.display.background) : "transparent");
  add("--supersample", ShowPicture::samples_at_rest);
  return line + " -o picture.png";
}

}  // namespace selvedge
