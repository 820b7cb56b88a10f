// swatch: draws a fabric by the reference evaluation, or its stitch by ray tracing.
#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/option_groups.h"
#include "converter/bake/truth_swatch.h"
#include "converter/stitch/find_cell.h"
#include "format/fabric/file.h"
#include "format/picture/display.h"
#include "format/picture/studio.h"
#include "format/picture/swatch_picture.h"

namespace selvedge {
namespace {

struct SwatchCommand {
  CommonOptions common;
  bool truth = false;  ///< the input is a stitch to be traced, else a fabric file
  std::string input;
  std::string output;  ///< .png or .exr
  CellOptions cell;    ///< with `truth`
  TruthOptions trace;
  SwatchView place = SwatchView::near;
  V2i size{320, 240};
  std::vector<Light> lights;  ///< empty: the lights of the place
  std::string environment;    ///< a picture of radiance; empty: none
  EnvironmentOptions around;
};

void declare(Options& options, SwatchCommand& command) {
  options.common(command.common);
  add_cell(options, command.input, command.cell)
      .help("A fabric file; with --truth a stitch, as bake takes it");
  options.group("");
  options.flag("--truth", command.truth, "Ray-trace the stitch itself, repeated");
  options
      .output(command.output, "The picture: .png as people see it, .exr linear with opacity",
              {".png", ".exr"})
      .required();
  add_place(options, "Camera of the swatch [near]", [&command](SwatchView place) { command.place = place; });
  options.size("--size", command.size, "Size of the picture in pixels", 1, 8192);
  add_lights(
      options, command.lights,
      "Direction to a light in the cloth's frame, and its intensity; may be repeated (a key light of 1 "
      "and a fill light of 0.3)");
  options
      .text("--environment", command.environment, "FILE|studio",
            "Environment light instead: an equirectangular picture (.hdr, .exr), as a lamp for each pixel of "
            "32 x 16 and up to four for bright spots. The exposure of PNG files is then 1")
      .reads();
  options.number("--environment-turn", command.around.turn, "DEGREES", "Turns it about the upward axis")
      .in(-360, 360);
  options.number("--environment-strength", command.around.strength, "FACTOR", "Factor on its radiance")
      .in(0, 1e6);
  options.group("With --truth");
  TruthOptions& trace = command.trace;
  options.number("--samples", trace.samples, "N", "Rays a pixel, an even number");
  add_transport(options, {trace.bounces, trace.ground, trace.reference});
  options.number("--seed", trace.seed, "N", "Same seed, same picture");
  options.check([&options, &command] {
    options.refuse_if(command.environment.empty(), "has no effect without --environment",
                      {"--environment-turn", "--environment-strength"});
    options.refuse_if(!command.environment.empty(), "has no effect with --environment", {"--light"});
    if (command.size.x > 4 * command.size.y) refuse("--size", "must be at most four times as wide as high");
    options.refuse_if(!command.truth, "is for --truth, not for a fabric file",
                      {"--set", "--grid", "--period", "--unit", "--up", "--albedo", "--samples", "--bounces",
                       "--ground", "--reference-height", "--seed"});
  });
}

SwatchShot shot_of(const SwatchCommand& command, const V2d& period_mm) {
  SwatchShot shot = swatch_shot(command.place, period_mm, command.size.x, command.size.y);
  if (!command.lights.empty()) shot.lights = command.lights;
  return shot;
}

/// Lamps above the cloth, which together are the environment.
std::vector<Light> lamps_above(const Environment& environment) {
  EnvironmentLight light;
  Environment rest = environment;
  light.lamps = take_lamps(rest);
  const std::vector<Light> others = lamps_of(reduced(rest, 32));
  light.lamps.insert(light.lamps.end(), others.begin(), others.end());
  std::erase_if(light.lamps, [](const Light& lamp) { return !(lamp.direction.z > 0); });
  return light.lamps;
}

TruthSwatch trace(const SwatchCommand& command) {
  const auto cell = value_or_throw(find_cell(command.input, command.cell));
  TerminalProgress progress("swatch", command.common.quiet);
  const SwatchShot shot = shot_of(command, cell.mesh.period);
  auto truth =
      value_or_throw(trace_swatch(cell.mesh, command.input, shot, command.trace, progress.callback()));
  report_remarks(command.common, command.input, cell.remarks);
  return truth;
}

/// The frame of a fabric, and the time that it took.
TruthSwatch draw(const SwatchCommand& command) {
  const auto fabric = value_or_throw(read_fabric(command.input));
  TruthSwatch drawn;
  const Stopwatch watch;
  drawn.frame = draw_swatch(fabric, shot_of(command, V2d(fabric.period_mm)));
  drawn.seconds = watch.seconds();
  return drawn;
}

TruthSwatch make(SwatchCommand command) {
  if (!command.environment.empty()) {
    command.lights = lamps_above(value_or_throw(environment_named(command.environment, command.around)));
  }
  TruthSwatch drawn = command.truth ? trace(command) : draw(command);
  DisplayOptions display = default_display();
  if (!command.environment.empty()) display.exposure = 1;
  value_or_throw(command.output.ends_with(".exr")
                     ? write_exr(command.output, to_linear_image(drawn.frame))
                     : write_png(command.output, to_display_image(drawn.frame, display)));
  return drawn;
}

Result<int> run(const SwatchCommand& command) {
  const TruthSwatch drawn = make(command);
  Json json = {
      {"input", command.input},          {"output", command.output}, {"bytes", size_of_file(command.output)},
      {"place", name_of(command.place)}, {"width", command.size.x},  {"height", command.size.y},
      {"truth", command.truth},          {"seconds", drawn.seconds}};
  std::string text = filled("{place} swatch, {width}x{height} pixels, in {seconds:.2f} s", json);
  if (command.truth) {
    json.update({{"samples", command.trace.samples / 2 * 2},
                 {"rays", drawn.rays},
                 {"noise", drawn.noise},
                 {"alphaNoise", drawn.alpha_noise}});
    text += filled(", {rays:.3g} rays, standard error {noise:.2g} (opacity {alphaNoise:.2g})", json);
  }
  report(command.common, "swatch", json, text + filled(" -> {output} ({bytes} bytes)\n", json));
  return 0;
}

}  // namespace

void add_swatch_verb(Program& program) {
  program.add<SwatchCommand>(
      {"swatch", "Draw a flat swatch: of a fabric, or with --truth of the stitch itself",
       "selvedge swatch --truth plain-knit --place middle -o truth.exr"},
      declare, run);
}

}  // namespace selvedge
