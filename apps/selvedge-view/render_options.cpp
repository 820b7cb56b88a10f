#include "apps/selvedge-view/shot.h"

#include <fmt/format.h>

#include <array>

#include "apps/common/shared_options.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

constexpr std::array<std::string_view, 3> context_names{"auto", "osmesa", "egl"};

void add_series(Options& options, RenderCommand& command) {
  options.begin_group("Many pictures (scenes)");
  options
      .number(
          "--turntable", command.turntable, "N",
          "Draw N frames once around a scene: name-0001.png and so on, or {frame} in the name; all or none")
      .in_range(1, 9999);
  options.flag("--top", command.has_top, "And one from above, whose {frame} is top");
  options.list("--variants", "all|NAME,...", "Each of these variants, as {variant} in the name of the file",
               [&command](const std::vector<std::string>& texts) {
                 for (const std::string& text : texts)
                   for (std::string& name : parts_of(text, ',')) command.variants.push_back(std::move(name));
               });
  options
      .list("--fabric", command.fabrics, "FILE",
            "In place of variants: on all that wears a fabric; may be repeated; its name is {variant}")
      .reads();
  options.text("--animation", command.animation, "NAME|N", "A clip of the file, which poses the scene");
  options.number("--time", command.time, "S", "At this time of the clip, which begins again after its end")
      .in_range(0, 1e6);
  options.text("--frames", "A..B",
               "Frames A to B of the clip: frame k is at k / fps; name-%04d.png in numbers",
               [&command](const std::string& text) {
                 const std::size_t dots = text.find("..");
                 if (dots == std::string::npos) refuse("--frames", "must be of the form 0..47");
                 const auto n = parse_integer_list(
                     "--frames", text.substr(0, dots) + "," + text.substr(dots + 2), ',', 2, 2, "0,47");
                 if (n[0] < 0 || n[1] < n[0] || n[1] > 1'000'000)
                   refuse("--frames", "must go up from 0 or more to at most 1000000");
                 command.frames = V2i(n[0], n[1]);
               });
  options.number("--fps", command.fps, "F", "Frames of --frames a second").in_range(0.001, 1000);
}

/// Refuses options that have no effect with this input or beside the others.
void check_render(const Options& options, const RenderCommand& command) {
  const bool swatch = has_ending(command.picture.input, ".exr");
  options.refuse_if(swatch, "is for scenes, not for a swatch",
                    {"--azimuth", "--elevation", "--fov", "--distance", "--look-at", "--zoom", "--focus",
                     "--camera", "--scene", "--variant", "--orthographic", "--turntable", "--layers",
                     "--ambient", "--animation", "--variants", "--fabric"});
  options.refuse_if(
      !command.file_camera.empty(), "has no effect with --camera",
      {"--azimuth", "--elevation", "--fov", "--orthographic", "--distance", "--look-at", "--turntable"});
  options.refuse_if(command.turntable == 0, "has no effect without --turntable", {"--top"});
  options.refuse_if(command.turntable > 0, "has no effect with --turntable", {"--frames"});
  options.refuse_if(command.animation.empty(), "has no effect without --animation", {"--time", "--frames"});
  options.refuse_if(command.frames.has_value(), "has no effect with --frames", {"--time"});
  options.refuse_if(!command.frames, "has no effect without --frames", {"--fps"});
  options.refuse_if(!command.variants.empty(), "has no effect with --variants", {"--variant", "--fabric"});
  options.refuse_if(command.streams() && command.common.json, "is for standard output, as -o - is",
                    {"--json"});
  for (const std::string& output : command.outputs) {
    options.refuse_if(!has_ending(output, ".png"), "is for PNG files", {"--if-changed"});
    if (command.has_variants() && (output == "-" || output.find("{variant}") == std::string::npos))
      refuse("--output", "needs {variant} in its name: there is a picture for each");
    if (output == "-" && !command.streams()) refuse("--output", "- is the only one, or none");
  }
  check_picture(options, command.picture);
  options.refuse_if(!swatch, "is for fabrics, not for a scene",
                    {"--place", "--repeats", "--view", "--pixels-per-texel"});
  options.refuse_if(command.place.has_value(), "has no effect with --place",
                    {"--repeats", "--view", "--pixels-per-texel"});
  options.refuse_if(swatch && !command.place, "has no effect with a swatch of whole texels, without --place",
                    {"--size"});
  options.refuse_if(command.render.path == RenderPath::paper,
                    "has no effect with --path paper, which shows no cell images", {"--image-memory"});
}

void add_swatch(Options& options, RenderCommand& command) {
  options.begin_group("Swatch (fabric files)");
  SwatchOptions& swatch = command.picture.swatch;
  add_repeats(options, swatch);
  options.number("--pixels-per-texel", swatch.pixels_per_texel, "N", "Size of a texel of the level");
  options.vector("--view", swatch.view, "X,Y,Z",
                 "Direction towards the viewer, in the fabric's frame (default 0,0,1)");
  options.choice(
      "--place", swatch_view_names,
      "Instead: in perspective from a place and under the lights of `selvedge truth`; --size counts",
      [&command](std::size_t index) { command.place = static_cast<SwatchView>(index); });
}

}  // namespace

void declare_render(Options& options, RenderCommand& command) {
  PictureOptions& picture = command.picture;
  options
      .list("-o,--output", command.outputs, "FILE|-",
            "The picture, .png or .exr; may be repeated. -: PNG on standard output, one after the other")
      .required()
      .ends_in({".png", ".exr", "-"})
      .writes();
  options.size("--size", command.size, "Size of a scene's picture in pixels", 1, 1'000'000);
  picture.image_memory_mib = 160;  // a still has images of one of three bands at a time
  options
      .number(
          "--accuracy", command.goal.accuracy_db, "DB",
          fmt::format("As many rays a pixel as this PSNR takes, against the picture with 64: 10 to 50 [{}]",
                      default_accuracy_db))
      .in_range(10, 50);
  options
      .number(
          "--seconds", command.goal.seconds, "S",
          "Instead: as many as this time of the clock allows, without reading files; fewer than one where "
          "it is short")
      .in_range(0.01, 86400);
  options.number("--supersample", command.supersample, "N", "Instead: N x N rays a pixel");
  command.key.declare(options);
  add_input(options, picture);
  options.choice("--path", path_names, command.render.path,
                 "Finds triangles, and shades: OpenGL and the processor (hybrid), the "
                 "processor (raster); paper: as published in 2001, in colours of 8 bits");
  options.choice("--context", context_names, command.render.context,
                 "OpenGL: Mesa's software rasteriser (auto, osmesa), or EGL's first device");
  add_series(options, command);
  options.begin_group("Camera (scenes)");
  add_camera(options, picture.camera);
  options.begin_group("Choices (scenes)");
  options.text("--camera", command.file_camera, "NAME|N",
               "A camera of the file, by name or number (default: one that shows all cloth)");
  add_scene_choice(options, command.choice);
  add_swatch(options, command);
  add_light(options, picture);
  options.add_check([&options, &command] {
    check_render(options, command);
    command.has_view_angles = options.is_given("--azimuth") || options.is_given("--elevation");
    command.picture.swatch.level = command.picture.levels.forced_level;
    const bool whole_texels = has_ending(command.picture.input, ".exr") && !command.place;
    // A swatch of whole texels shows each of them as it is; where no accuracy counts, outlines are smooth.
    command.render.supersample = command.supersample.value_or(whole_texels ? 1 : 2);
    options.refuse_if(whole_texels, "has no effect with a swatch of whole texels, without --place",
                      {"--accuracy", "--seconds"});
    options.refuse_if(command.supersample.has_value(), "has no effect with --supersample",
                      {"--accuracy", "--seconds"});
    options.refuse_if(options.is_given("--seconds"), "has no effect with --seconds", {"--accuracy"});
    if (!whole_texels && !command.supersample && !command.goal.seconds && !command.goal.accuracy_db &&
        command.render.path != RenderPath::paper)
      command.goal.accuracy_db = default_accuracy_db;
  });
}

}  // namespace selvedge
