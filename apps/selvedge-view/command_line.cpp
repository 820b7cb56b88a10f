#include "apps/selvedge-view/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "apps/selvedge-view/idle_options.h"
#include "apps/selvedge-view/trade_settings.h"
#include "format/base/option_text.h"
#include "viewer/light/shadows.h"

namespace selvedge {
namespace {

std::vector<double> checked(const std::string& option, const std::string& text, char separator,
                            std::size_t least, std::size_t most) {
  const auto numbers = parse_numbers(text, separator, least, most);
  if (!numbers)
    throw CLI::ValidationError(
        option, fmt::format("\"{}\" is not {} numbers separated by '{}'", text,
                            least == most ? fmt::format("{}", least) : fmt::format("{} to {}", least, most),
                            separator));
  return *numbers;
}

V3d vector_of(const std::vector<double>& n) { return {n[0], n[1], n[2]}; }

V2i pair_of(const std::string& option, const std::string& text) {
  const std::vector<double> n = checked(option, text, 'x', 2, 2);
  for (const double value : n) {
    if (value != std::floor(value) || value < 1 || value > 1e6)
      throw CLI::ValidationError(option, fmt::format("\"{}\" is not a pair such as 4x3", text));
  }
  return {static_cast<int>(n[0]), static_cast<int>(n[1])};
}

/// One of the names, in the order of the enumeration.
template <class Enum, std::size_t Count>
CLI::Option* add_choice(CLI::App& app, const std::string& name,
                        const std::array<std::string_view, Count>& names, Enum& target,
                        const std::string& help) {
  return app
      .add_option_function<std::string>(
          name,
          [&names, &target](const std::string& text) {
            target = static_cast<Enum>(std::find(names.begin(), names.end(), text) - names.begin());
          },
          help)
      ->type_name(fmt::format("{}", fmt::join(names, "|")))
      ->check(CLI::IsMember(std::vector<std::string>(names.begin(), names.end())));
}

/// An option whose text is turned into a value while parsing.
template <class Function>
CLI::Option* add_text(CLI::App& app, const std::string& name, const std::string& type,
                      const std::string& help, Function&& take) {
  return app
      .add_option_function<std::string>(
          name, [take = std::forward<Function>(take)](const std::string& text) { take(text); }, help)
      ->type_name(type);
}

void add_camera(CLI::App& app, CameraOptions& camera) {
  const char* group = "Camera (scenes)";
  app.add_option("--azimuth", camera.azimuth, "0 faces the scene's front (+z), 90 its +x side")
      ->type_name("DEGREES")
      ->capture_default_str()
      ->group(group);
  app.add_option("--elevation", camera.elevation, "Above the horizon")
      ->type_name("DEGREES")
      ->capture_default_str()
      ->group(group);
  app.add_option("--fov", camera.field_of_view, "Vertical field of view")
      ->type_name("DEGREES")
      ->capture_default_str()
      ->group(group);
  app.add_flag_callback(
         "--orthographic", [&] { camera.projection = Projection::parallel; },
         "Parallel instead of perspective projection")
      ->group(group);
  app.add_option("--distance-factor", camera.distance_factor, "Times the distance that just shows everything")
      ->type_name("FACTOR")
      ->capture_default_str()
      ->group(group);
  add_text(app, "--look-at", "X,Y,Z",
           "Point in metres that is shown in the middle (default: the scene's centre)",
           [&](const std::string& t) { camera.look_at = vector_of(checked("--look-at", t, ',', 3, 3)); })
      ->group(group);
  app.add_option("--distance", camera.distance, "Metres from that point")->type_name("METRES")->group(group);
  app.add_option("--zoom", camera.zoom, "Narrow the frame by this factor")
      ->type_name("FACTOR")
      ->capture_default_str()
      ->group(group);
  add_text(app, "--focus", "X,Y", "Around this point of the frame; 0,0 is its top left, 1,1 its bottom right",
           [&](const std::string& t) {
             const std::vector<double> n = checked("--focus", t, ',', 2, 2);
             camera.focus = V2d(n[0], n[1]);
           })
      ->group(group);
}

void add_choice(CLI::App& app, RenderCommand& command) {
  const char* group = "Choices (scenes)";
  app.add_option("--camera", command.camera_of_file,
                 "A camera of the file, by name or number (default: one that shows everything)")
      ->type_name("NAME|N")
      ->group(group);
  app.add_option("--scene", command.choice.scene, "A scene of the file (default: the one it names)")
      ->type_name("NAME|N")
      ->group(group);
  app.add_option("--variant", command.choice.variant, "A variant of its materials (default: none)")
      ->type_name("NAME|N")
      ->group(group);
}

void add_repeats(CLI::App& app, SwatchOptions& swatch, const char* group) {
  add_text(app, "--repeats", "NxM",
           fmt::format("Repeats of the fabric across and down (default {}x{})", swatch.repeats.x,
                       swatch.repeats.y),
           [&](const std::string& t) { swatch.repeats = pair_of("--repeats", t); })
      ->group(group);
}

void add_swatch(CLI::App& app, RenderCommand& command) {
  const char* group = "Swatch (fabric files)";
  add_repeats(app, command.swatch, group);
  app.add_option("--pixels-per-texel", command.swatch.pixels_per_texel, "Size of a texel of the level")
      ->type_name("N")
      ->capture_default_str()
      ->group(group);
  add_text(app, "--view", "X,Y,Z", "Direction towards the viewer, in the fabric's frame (default 0,0,1)",
           [&](const std::string& t) { command.swatch.view = vector_of(checked("--view", t, ',', 3, 3)); })
      ->group(group);
  app.add_option_function<std::string>(
         "--place", [&](const std::string& t) { command.place = swatch_view_named(t); },
         "Instead: in perspective from a place and under the lights of `selvedge swatch`; --size counts")
      ->type_name("near|middle|far|grazing")
      ->check(CLI::IsMember(std::vector<std::string>(swatch_view_names.begin(), swatch_view_names.end())))
      ->group(group);
}

/// An option that may be repeated: three numbers and an intensity. take(numbers, intensity) tells whether
/// they make a light.
template <class Function>
CLI::Option* add_lights(CLI::App& app, const std::string& name, const std::string& type,
                        const std::string& help, Function&& take) {
  return app
      .add_option_function<std::vector<std::string>>(
          name,
          [name, take = std::forward<Function>(take)](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              const std::vector<double> n = checked(name, text, ',', 3, 4);
              const double intensity = n.size() > 3 ? n[3] : 1;
              if (!(intensity >= 0 && intensity <= max_intensity) ||
                  !take(vector_of(n), static_cast<float>(intensity)))
                throw CLI::ValidationError(
                    name, fmt::format("\"{}\" has no direction or no intensity in 0 to 1e12", text));
            }
          },
          help)
      ->type_name(type)
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

/// Lights and what becomes of radiance; the same for all that draw.
template <class Command>
void add_light(CLI::App& app, Command& command, float& ambient, int& shadows) {
  command.display = default_display();
  const char* group = "Light and picture";
  add_lights(app, "--light", "X,Y,Z[,I]",
             "Direction to a light, and its intensity (default 1: the picture shows 1/sr); may be repeated. "
             "Without any: the lights of the scene, or else "
             "a key light from the upper left of the camera, a weaker one from the right",
             [&](const V3d& direction, float irradiance) {
               if (!(direction.length() > 0)) return false;
               Light light;
               light.direction = direction.normalized();
               light.irradiance = V3f(irradiance);
               command.lights.push_back(light);
               return true;
             })
      ->group(group);
  add_lights(app, "--point-light", "X,Y,Z[,I]",
             "Place of a light in metres, in the scene's axes, and its intensity at a distance of 1 m "
             "(default 1); may be repeated",
             [&](const V3d& position, float irradiance) {
               Light light;
               light.kind = LightKind::point;
               light.position = position;
               light.irradiance = V3f(irradiance);
               command.lights.push_back(light);
               return true;
             })
      ->group(group);
  app.add_option_function<std::string>(
         "--light-frame", [&](const std::string& t) { command.lights_in_camera_frame = t == "camera"; },
         "Axes of --light: the scene's, or the camera's (right, up, towards the viewer)")
      ->type_name("world|camera")
      ->check(CLI::IsMember({"world", "camera"}))
      ->group(group);
  // A flag: a number that stood apart could be the input.
  app.add_flag(fmt::format("--shadows{{{}}}", default_shadow_size), shadows,
               "Shadows of lights far away and of spots, by maps; --shadows=SIZE says how many texels a side")
      ->check(CLI::Range(min_shadow_size, max_shadow_size))
      ->group(group);
  app.add_option(
         "--ambient", ambient,
         "Light from all sides on materials without a fabric: white ones show so much of what they show "
         "facing a light of intensity 1")
      ->type_name("SHARE")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6))
      ->group(group);
  app.add_option(
         "--exposure", command.display.exposure,
         "Factor on radiance in PNG files (default pi: white that faces a light of intensity 1 becomes 1)")
      ->type_name("FACTOR")
      ->check([](const std::string& text) {
        const auto factor = parse_numbers(text, ',', 1, 1);
        const bool good = factor && factor->front() >= 0 && factor->front() <= 1e9;
        return good ? std::string() : "\"" + text + "\" is not in 0 to 1e9";
      })
      ->group(group);
  add_text(app, "--background", "R,G,B|transparent", "Of PNG files, linear (default 0.18,0.18,0.18)",
           [&](const std::string& t) {
             command.display.background.reset();
             if (t != "transparent")
               command.display.background = V3f(vector_of(checked("--background", t, ',', 3, 3)));
           })
      ->group(group);
  add_choice(app, "--tone-map", tone_curve_names, command.display.tone,
             "Curve over exposed colours in PNG files (default none)")
      ->group(group);
}

/// Levels, layers and the like.
void add_levels(CLI::App& app, LevelOptions& levels, int& layers) {
  app.add_option("--layers", layers, "Surfaces behind each other that show through holes (1 to 64)")
      ->type_name("N")
      ->capture_default_str();
  app.add_option_function<std::string>(
         "--level-blend", [&](const std::string& t) { levels.blend = t == "on"; },
         "Blend between two mip levels (default on)")
      ->type_name("on|off")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option("--level", levels.forced,
                 "Mip level of the whole fabric to show everywhere (default: by the pixel's footprint)")
      ->type_name("K")
      ->check(CLI::Range(0, 30));
  app.add_option_function<std::string>(
         "--filter",
         [&](const std::string& t) {
           levels.linear = t == "linear";
           levels.bias = t == "linear" ? best_levels.bias : 0.0F;
         },
         "Between the texels of coarser levels: linear (default), or the nearest: faster, rougher")
      ->type_name("nearest|linear")
      ->check(CLI::IsMember({"nearest", "linear"}));
  app.add_option(
         "--anisotropy", levels.taps,
         "Taps along a pixel's footprint where the cloth is seen at a grazing angle, at most N (1 to 4; with "
         "nearest texels to 16)")
      ->type_name("N")
      ->capture_default_str();
}

/// Levels and samples a pixel at once; those of their options that are given stay.
void set_quality(const CLI::App& app, const std::string& quality, RenderOptions& render) {
  if (quality.empty()) return;
  const auto* const name = std::find(frame_quality_names.begin(), frame_quality_names.end(), quality);
  const RenderOptions wanted =
      quality_setting(static_cast<std::size_t>(name - frame_quality_names.begin())).render;
  if (app.count("--supersample") == 0) render.supersample = wanted.supersample;
  if (app.count("--power") == 0 && render.path != RenderPath::shader) render.power = wanted.power;
  if (app.count("--level") == 0) render.levels.forced = wanted.levels.forced;
  if (app.count("--level-blend") == 0) render.levels.blend = wanted.levels.blend;
  if (app.count("--anisotropy") == 0) render.levels.taps = wanted.levels.taps;
  if (app.count("--filter") > 0) return;
  render.levels.linear = wanted.levels.linear;
  render.levels.bias = wanted.levels.bias;
}

void add_threads(CLI::App& app, int& threads) {
  app.add_option("--threads", threads, "Threads to work with; 0: all cores")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(0, 4096));
}

void add_render(CLI::App& app, RenderCommand& command, std::string& quality) {
  command.render.levels = best_levels;
  app.footer(
      "Examples:\n"
      "  selvedge-view render sweater.glb -o sweater.png --size 1280x960 --azimuth 30 --supersample 2\n"
      "  selvedge-view render knit.fabric.exr -o knit.exr --repeats 4x4 --light 0,0.5,1 --view 0,-1,1\n"
      "\nPNG: radiance * exposure, tone curve, over the background, clipped, sRGB.\n"
      "EXR: linear radiance * opacity, and opacity.\n"
      "Tone curves of an exposed colour c: reinhard is c / (1 + Y), Y its luminance (Reinhard et al. 2002,\n"
      "equation 3); aces is c (2.51 c + 0.03) / (c (2.43 c + 0.59) + 0.14) per channel (Narkowicz 2016).\n"
      "Exit status: 0 good, 1 the input is bad, 2 usage.");
  app.add_option("input", command.input, "A glTF scene (.gltf, .glb) or a fabric (.exr)")
      ->required()
      ->type_name("FILE");
  app.add_option("-o,--output", command.outputs, "The picture, .png or .exr; may be repeated")
      ->required()
      ->type_name("FILE")
      ->expected(1)
      ->check([](const std::string& path) {
        const bool good = has_ending(path, ".png") || has_ending(path, ".exr");
        return good ? std::string() : "\"" + path + "\" does not end in .png or .exr";
      })
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  add_text(app, "--size", "WxH", "Size of a scene's picture in pixels (default 800x600)",
           [&](const std::string& t) {
             const V2i size = pair_of("--size", t);
             command.render.width = size.x;
             command.render.height = size.y;
           });
  app.add_option("--supersample", command.render.supersample, "Draw N times larger per side, and average")
      ->type_name("N")
      ->capture_default_str();
  add_levels(app, command.render.levels, command.render.layers);
  app.add_option(
         "--quality", quality,
         "Filter, taps, powers and samples a pixel that are worth their time (standard: the default with "
         "fast powers); options given beside it stay as given. With --path paper powers and samples count")
      ->type_name("draft|standard|high|reference")
      ->check(
          CLI::IsMember(std::vector<std::string>(frame_quality_names.begin(), frame_quality_names.end())));
  add_choice(app, "--path", path_names, command.render.path,
             "Who evaluates the fabrics: the processor (default) or OpenGL. paper: as published in 2001, in "
             "colours of 8 bits, nearest texels");
  add_choice(
      app, "--power", power_names, command.render.power,
      "How the processor computes the powers of lobes: exact (default) to about a float, fast to 1e-4");
  app.add_option_function<std::string>(
         "--context",
         [&](const std::string& t) {
           command.render.context = t == "egl"      ? ContextKind::egl
                                    : t == "osmesa" ? ContextKind::osmesa
                                                    : ContextKind::automatic;
         },
         "Whose OpenGL: Mesa's software rasteriser, or EGL's first device (default auto: EGL for the shader "
         "path, if it is there)")
      ->type_name("auto|osmesa|egl")
      ->check(CLI::IsMember({"auto", "osmesa", "egl"}));
  add_threads(app, command.threads);
  app.add_option("--turntable", command.turntable,
                 "Draw N frames once around a scene: name-0001.png and so on, all of them or none")
      ->type_name("N")
      ->check(CLI::Range(1, 9999));
  app.add_option(
         "--compare", command.compare,
         "Draw beside it another scene (.gltf, .glb), or the same in another fabric (.exr), by the same "
         "camera and lights; a black line lies between them")
      ->type_name("FILE");
  app.add_option("--stats", command.stats, "Report sizes, times and bytes as JSON into a file; - is --json")
      ->type_name("FILE|-");
  app.add_flag("--json", command.json, "The same on standard output");
  app.add_flag("--quiet", command.quiet, "No remarks on standard error");
  add_camera(app, command.camera);
  add_choice(app, command);
  add_swatch(app, command);
  add_light(app, command, command.render.ambient, command.render.shadows);
}

void add_show(CLI::App& app, ShowCommand& command) {
  app.footer(
      "Examples:\n"
      "  selvedge-view show sweater.glb\n"
      "  selvedge-view show sweater.glb --fabric rib.fabric.exr --azimuth 30\n"
      "\nMouse: left drag turns around the garment, middle drag (or Shift + left) moves it, right drag (or\n"
      "Ctrl + left) turns the light, the wheel comes nearer. Keys: E texel edges, P probe, F next\n"
      "fabric, R first view, H panel, Escape closes.\n"
      "Exit status: 0 good, 1 the input is bad or there is no display, 2 usage.");
  app.add_option("input", command.input, "A glTF scene (.gltf, .glb) or a fabric (.exr)")
      ->required()
      ->type_name("FILE");
  app.add_option("--fabric", command.fabrics, "A fabric file to choose from; may be repeated")
      ->type_name("FILE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  add_text(app, "--size", "WxH", "Size of the window (default 1280x800)",
           [&](const std::string& t) { command.size = pair_of("--size", t); });
  add_levels(app, command.levels, command.layers);
  app.add_flag("--texel-edges", command.texel_edges, "Begin with lines where texels end");
  app.add_option("--screenshot", command.screenshot, "Write the window as it was when it closed")
      ->type_name("FILE")
      ->check([](const std::string& path) {
        return has_ending(path, ".png") ? std::string() : "\"" + path + "\" does not end in .png";
      });
  add_threads(app, command.threads);
  app.add_flag("--json", command.json,
               "Report the last view, probe and times as JSON when the window closes");
  app.add_flag("--quiet", command.quiet, "No remarks on standard error");
  add_camera(app, command.camera);
  command.swatch.repeats = V2i(4, 4);
  add_repeats(app, command.swatch, "Swatch (fabric files)");
  add_light(app, command, command.ambient, command.shadows);
}

void add_compare(CLI::App& app, CompareCommand& command) {
  app.footer(
      "Example:\n"
      "  selvedge-view compare before.png after.png --max 0.02\n"
      "\nPNG values are compared as stored (sRGB-encoded, 1 is white), EXR values as they are. PSNR and "
      "SSIM\n"
      "are of the colours, the largest difference and RMSE of opacity, too.\n"
      "Exit status: 0 good, 1 an input is bad or the pictures differ beyond --max, 2 usage.");
  app.add_option("first", command.first, "A picture")->required()->type_name("FILE");
  app.add_option("second", command.second, "Another of the same size")->required()->type_name("FILE");
  app.add_option("--max", command.max, "Largest absolute difference of a value that is still good")
      ->type_name("BOUND")
      ->check(CLI::Range(0.0, 1e30));
  app.add_flag("--json", command.json, "Report as JSON on standard output");
}

void add_trade(CLI::App& app, TradeCommand& command) {
  app.footer(
      "Example:\n"
      "  selvedge trade plain-knit -o trade-knit && selvedge-view trade trade-knit\n"
      "\nExit status: 0 good, 1 the input is bad, 2 usage.");
  app.add_option("folder", command.folder, "What selvedge trade has made")->required()->type_name("DIR");
  app.add_option("--repeats", command.repeats, "Times are medians of so many frames")
      ->type_name("N")
      ->capture_default_str()
      ->check(CLI::Range(1, 999));
  add_text(app, "--size", "WxH", "Of the frames that are timed (640x480)", [&](const std::string& t) {
    command.size = pair_of("--size", t);
    if (command.size.x > 4 * command.size.y || std::max(command.size.x, command.size.y) > 8192)
      throw CLI::ValidationError("--size", "must be at most 8192, and four times as wide as high");
  });
  add_threads(app, command.threads);
  app.add_flag("--json", command.json, "Report as JSON on standard output");
  app.add_flag("--quiet", command.quiet, "No progress, no line per setting");
}

}  // namespace

Command parse_command_line(int argc, const char* const* argv) {
  CLI::App app("Shows garments dressed in Selvedge fabrics.", "selvedge-view");
  app.footer("Example:\n  selvedge-view render sweater.glb -o sweater.png --size 1280x960");
  app.set_version_flag("--version", "selvedge-view " SELVEDGE_VERSION);
  app.require_subcommand(1);
  RenderCommand render;
  ShowCommand show;
  CompareCommand compare;
  CLI::App* render_verb =
      app.add_subcommand("render", "Draws a scene, or a swatch of a fabric, into PNG and EXR files");
  CLI::App* compare_verb = app.add_subcommand("compare", "Tells how far two pictures are apart");
  CLI::App* show_verb = app.add_subcommand("show", "Opens a window in which a scene can be handled");
  TradeCommand trade;
  CLI::App* trade_verb =
      app.add_subcommand("trade", "Adds the viewer's settings and times to a sweep over speed and accuracy");
  add_trade(*trade_verb, trade);
  std::string quality;
  add_render(*render_verb, render, quality);
  add_show(*show_verb, show);
  add_compare(*compare_verb, compare);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return ExitNow{app.exit(e)};
    // CLI11's own codes for usage errors lie above 100, and its messages take several lines.
    fmt::print(stderr, "selvedge-view: {}; see --help\n", e.what());
    return ExitNow{2};
  }
  if (compare_verb->parsed()) return compare;
  if (trade_verb->parsed()) return trade;
  const auto given = [&](const char* option) {
    return (show_verb->parsed() ? show_verb : render_verb)->count(option) > 0;
  };
  const std::string idle = show_verb->parsed() ? idle_option(show, given) : idle_option(render, given);
  if (!idle.empty()) {
    fmt::print(stderr, "selvedge-view: {}; see --help\n", idle);
    return ExitNow{2};
  }
  if (show_verb->parsed()) return show;
  set_quality(*render_verb, quality, render.render);
  if (render.render.path == RenderPath::paper) {
    // Refused where they were asked for.
    LevelOptions& levels = render.render.levels;
    if (render_verb->count("--filter") == 0) {
      levels.linear = false;
      levels.bias = 0;
    }
    if (render_verb->count("--anisotropy") == 0) levels.taps = 1;
  }
  render.swatch.level = render.render.levels.forced;
  return render;
}

}  // namespace selvedge
