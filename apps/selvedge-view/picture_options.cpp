#include "apps/selvedge-view/picture_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>

#include "format/base/option_text.h"
#include "format/picture/environment.h"

namespace selvedge {
namespace {

constexpr std::array<std::string_view, 2> frame_names{"world", "camera"};

/// Strength of the studio where the scene has lamps: what it lights is seen, and the lamps make the
/// picture. At their exposure of pi a quarter of its brightness in scenes without lamps.
constexpr double fill_strength = 0.25 * std::numbers::inv_pi;

}  // namespace

void add_input(Options& options, PictureOptions& picture) {
  options.text("input", picture.input, "FILE", "A glTF scene (.gltf, .glb) or a fabric (.exr)")
      .required()
      .reads();
  add_limits(options, picture.limits);
  options.number("--layers", picture.layers, "N",
                 "Surfaces behind each other that show through holes (1 to 64)");
  options
      .number("--image-memory", picture.image_memory_mib, "MIB",
              "MiB that the cell images of a frame take at most; without room for them they are coarser")
      .in_range(4, 65536);
  options
      .number("--level", picture.levels.forced_level, "K",
              "Mip level of the whole fabric to show everywhere (default: by the pixel's footprint)")
      .in_range(0, 30);
}

void add_repeats(Options& options, SwatchOptions& swatch) {
  options.size("--repeats", swatch.repeats, "Repeats of the fabric across and down", 1, 10000);
}

void add_light(Options& options, PictureOptions& picture) {
  options.begin_group("Light and picture");
  add_lights(options, "--light", LightKind::directional, picture.lights,
             "Direction to a light, and its intensity (default 1: the picture shows 1/sr); may be repeated. "
             "Without any: the lights of the scene, or else the environment");
  add_lights(options, "--point-light", LightKind::point, picture.lights,
             "Place of a light in metres, in the scene's axes, and its intensity at a distance of 1 m "
             "(default 1); may be repeated");
  options.choice("--light-frame", frame_names,
                 "Axes of --light: the scene's, or the camera's (right, up, towards the viewer)",
                 [&picture](std::size_t index) { picture.lights_in_camera_frame = index == 1; });
  options
      .number("--shadows", picture.shadow_map_size, "SIZE",
              "Texels per side of the shadow maps of directional lights and spots, 16 to 8192; 0: no shadows")
      .in_range(0, max_shadow_size);
  options
      .number(
          "--ambient", picture.ambient_irradiance, "FRACTION",
          "Even light from all sides, as a fraction of what white reflects that faces a light of intensity 1")
      .in_range(0, 1e6);
  options
      .number("--exposure", picture.exposure, "FACTOR",
              "Factor on radiance in PNG files (default 1 in an environment; else pi: white that faces a "
              "light of intensity 1 becomes 1)")
      .in_range(0, 1e9);
  options.text("--background", "R,G,B|transparent",
               "Of PNG files, linear (default 0.8,0.8,0.8 in an environment, else 0.18,0.18,0.18)",
               [&picture](const std::string& t) {
                 picture.has_background = true;
                 picture.display.background.reset();
                 if (t == "transparent") return;
                 const auto n =
                     parse_number_list("--background", t, ',', 3, 3, "0.18,0.18,0.18 or transparent");
                 picture.display.background = V3f(V3d(n[0], n[1], n[2]));
               });
  options.choice("--tone-map", tone_curve_names,
                 "Curve over exposed colours in PNG files (default neutral in an environment, else none)",
                 [&picture](std::size_t index) { picture.tone_curve = static_cast<ToneCurve>(index); });
  add_environment(options, picture.environment, picture.environment_options,
                  "Default: the studio, weaker with lights of the scene; none for swatches and with --light");
  options.flag("--backdrop", picture.has_backdrop, "Shows it behind the scene");
  options
      .number("--backdrop-blur", picture.backdrop_roughness, "ROUGHNESS",
              "Blurs it as a mirror of this roughness does")
      .in_range(0, 1);
}

void check_picture(const Options& options, const PictureOptions& picture) {
  const auto is_far_away = [](const Light& light) { return light.kind == LightKind::directional; };
  const bool has_distance = picture.camera.distance.has_value();
  options.refuse_if(has_ending(picture.input, ".exr"), "has no effect with a swatch, which is flat",
                    {"--shadows"});
  if (picture.shadow_map_size > 0 && picture.shadow_map_size < min_shadow_size)
    refuse("--shadows", fmt::format("must be 0 or lie between {} and {}", min_shadow_size, max_shadow_size));
  options.refuse_if(std::none_of(picture.lights.begin(), picture.lights.end(), is_far_away),
                    "has no effect without --light", {"--light-frame"});
  // A parallel camera shows everything, or the same height as a perspective one at the distance.
  options.refuse_if(picture.camera.projection == Projection::parallel && !has_distance,
                    "has no effect with --orthographic, without --distance", {"--fov"});
  options.refuse_if(!picture.has_backdrop, "has no effect without --backdrop", {"--backdrop-blur"});
  const bool is_dark =
      picture.environment == "none" ||
      (picture.environment.empty() && (has_ending(picture.input, ".exr") || !picture.lights.empty()));
  options.refuse_if(is_dark, "has no effect without --environment",
                    {"--backdrop", "--environment-turn", "--environment-strength"});
}

std::vector<Light> Look::all_lights(const Camera& camera) const {
  std::vector<Light> all = lights_in_camera_frame ? camera_to_world(camera, lights) : lights;
  all.insert(all.end(), light.lamps.begin(), light.lamps.end());
  return all;
}

Result<Look> look_of(const PictureOptions& picture, const std::vector<Light>& own, std::uint64_t memory) {
  const bool is_swatch = has_ending(picture.input, ".exr");
  Look look;
  look.lights = picture.lights.empty() ? own : picture.lights;
  look.lights_in_camera_frame = !picture.lights.empty() && picture.lights_in_camera_frame;
  std::string& name = look.environment_name = picture.environment;
  if (name.empty()) name = is_swatch || !picture.lights.empty() ? "none" : "studio";
  const bool is_fill = picture.environment.empty() && name != "none" && !own.empty();
  EnvironmentOptions around = picture.environment_options;
  if (is_fill) around.strength *= fill_strength;
  if (name != "none") {
    if (is_swatch) look.lights = picture.lights;
    Result<Environment> environment = load_environment(name, around, memory);
    if (!environment) return tl::unexpected(environment.error());
    look.light = split_light(*environment);
    look.environment = std::make_shared<const Environment>(std::move(*environment));
  } else if (look.lights.empty()) {
    look.lights = key_and_fill_lights();
    look.lights_in_camera_frame = true;
  }
  look.light.smooth_light.coefficients[0] +=
      V3f(static_cast<float>(picture.ambient_irradiance * std::numbers::inv_pi));
  look.display = look.environment && !is_fill ? environment_display() : picture.display;
  if (picture.has_background) look.display.background = picture.display.background;
  if (picture.tone_curve) look.display.tone_curve = *picture.tone_curve;
  if (picture.exposure) look.display.exposure = static_cast<float>(*picture.exposure);
  if (!is_swatch) look.shadow_map_size = picture.shadow_map_size;
  return look;
}

}  // namespace selvedge
