// truth: a ray-traced picture of a stitch, flat and repeated.
#include "apps/common/shared_options.h"
#include "apps/selvedge/commands.h"
#include "apps/selvedge/option_groups.h"
#include "converter/bake/truth_swatch.h"
#include "converter/stitch/find_cell.h"
#include "format/picture/display.h"

namespace selvedge {
namespace {

struct TruthCommand {
  CommonOptions common;
  std::string input;
  std::string output;  ///< .png or .exr
  CellOptions cell;
  TruthOptions trace;
  SwatchView place = SwatchView::near;
  V2i size{320, 240};
  std::vector<Light> lights;  ///< empty: the lights of the place
};

void declare(Options& options, TruthCommand& command) {
  options
      .output(command.output, "The picture: .png as people see it, .exr linear with opacity",
              {".png", ".exr"})
      .required();
  options.choice("--place", swatch_view_names, command.place, "Camera of the swatch");
  options.size("--size", command.size, "Size of the picture in pixels", 1, 8192);
  add_lights(
      options, "--light", LightKind::directional, command.lights,
      "Direction to a light in the cloth's frame, and its intensity; may be repeated (a key light of 1 "
      "and a fill light of 0.3)");
  TruthOptions& trace = command.trace;
  options.number("--samples", trace.samples, "N", "Rays a pixel, an even number");
  add_bounces(options, trace.bounces);
  options.number("--seed", trace.seed, "N", "Same seed, same picture");
  add_cell(options, command.input, command.cell);
  options.add_check([&command] {
    if (command.size.x > 4 * command.size.y) refuse("--size", "must be at most four times as wide as high");
  });
}

Result<int> run(const TruthCommand& command) {
  const auto cell = value_or_throw(find_cell(command.input, command.cell));
  TerminalProgress progress("truth", command.common.quiet);
  SwatchShot shot = swatch_shot(command.place, cell.mesh.period, command.size.x, command.size.y);
  if (!command.lights.empty()) shot.lights = command.lights;
  const TruthSwatch traced =
      value_or_throw(trace_swatch(cell.mesh, command.input, shot, command.trace, progress.callback()));
  report_remarks(command.common, command.input, cell.remarks);
  value_or_throw(command.output.ends_with(".exr")
                     ? write_exr(command.output, to_linear_image(traced.frame))
                     : write_png(command.output, to_display_image(traced.frame, default_display())));
  const Json json = {{"input", command.input},
                     {"output", command.output},
                     {"bytes", file_size_or_zero(command.output)},
                     {"place", name_of(command.place)},
                     {"width", command.size.x},
                     {"height", command.size.y},
                     {"seconds", traced.seconds},
                     {"samples", command.trace.samples},
                     {"noise", traced.noise},
                     {"alphaNoise", traced.alpha_noise}};
  report(command.common, "truth", json,
         fill_pattern("{place} swatch, {width}x{height} pixels, in {seconds:.2f} s, standard error "
                      "{noise:.2g} (opacity {alphaNoise:.2g}) -> {output} ({bytes} bytes)\n",
                      json));
  return 0;
}

}  // namespace

void add_truth_verb(Program& program) {
  program.add<TruthCommand>({"truth", "Ray-trace a picture of the stitch itself, flat and repeated",
                             "selvedge truth plain-knit --place middle -o truth.exr"},
                            declare, run);
}

}  // namespace selvedge
