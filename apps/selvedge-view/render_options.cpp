#include "apps/selvedge-view/render_options.h"

#include <fmt/format.h>

#include <array>

#include "apps/common/shared_options.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

constexpr std::array<std::string_view, 3> context_names{"auto", "osmesa", "egl"};
constexpr std::array contexts{ContextKind::automatic, ContextKind::osmesa, ContextKind::egl};

/// Refuses options that have no effect with this input or beside the others.
void check_render(const Options& options, const RenderCommand& command) {
  const bool swatch = has_ending(command.picture.input, ".exr");
  options.refuse_if(
      swatch, "is for scenes, not for a swatch",
      {"--azimuth", "--elevation", "--fov", "--distance", "--look-at", "--zoom", "--focus", "--camera",
       "--scene", "--variant", "--orthographic", "--turntable", "--layers", "--ambient"});
  options.refuse_if(
      !command.file_camera.empty(), "has no effect with --camera",
      {"--azimuth", "--elevation", "--fov", "--orthographic", "--distance", "--look-at", "--turntable"});
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

void add_drawing(Options& options, RenderCommand& command) {
  options.choice("--path", path_names, command.render.path,
                 "Finds triangles, and shades: OpenGL and the processor (hybrid), the "
                 "processor (raster); paper: as published in 2001, in colours of 8 bits");
  options.choice("--context", context_names,
                 "OpenGL: Mesa's software rasteriser (the default, auto), or EGL's first device",
                 [&command](std::size_t index) { command.render.context = contexts[index]; });
}

void add_swatch(Options& options, RenderCommand& command) {
  options.begin_group("Swatch (fabric files)");
  SwatchOptions& swatch = command.picture.swatch;
  add_repeats(options, swatch);
  options.number("--pixels-per-texel", swatch.pixels_per_texel, "N", "Size of a texel of the level");
  options.vector("--view", swatch.view, "X,Y,Z",
                 "Direction towards the viewer, in the fabric's frame (default 0,0,1)");
  add_place(options,
            "Instead: in perspective from a place and under the lights of `selvedge truth`; --size counts",
            [&command](SwatchView place) { command.place = place; });
}

}  // namespace

void declare_render(Options& options, RenderCommand& command) {
  PictureOptions& picture = command.picture;
  options.list("-o,--output", command.outputs, "FILE", "The picture, .png or .exr; may be repeated")
      .required()
      .ends_in({".png", ".exr"})
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
  add_input(options, picture);
  add_drawing(options, command);
  options
      .number("--turntable", command.turntable, "N",
              "Draw N frames once around a scene: name-0001.png and so on, all of them or none")
      .in_range(1, 9999);
  options.begin_group("Camera (scenes)");
  add_camera(options, picture.camera);
  options.number("--distance", picture.camera.distance, "METRES", "Metres from that point");
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
