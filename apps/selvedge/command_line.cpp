// The verbs fit, make and trade: their options and the checks between them.
#include "apps/selvedge/command_line.h"

#include <fmt/format.h>

#include <array>

#include "apps/selvedge/commands.h"
#include "apps/selvedge/option_groups.h"
#include "apps/selvedge/run_fit.h"

namespace selvedge {
namespace {

void declare(Options& options, FitCommand& command) {
  options.common(command.common);
  options.text("samples", command.input, "FILE", "The samples file").required();
  add_fit(options, command.options);
  options.group("");
  options.output(command.output, "The fabric file").required();
  add_quality(options, command.quality);
  options.check([&options, &command] { apply_quality(options, command.quality, command.options); });
}

/// Refuses options that the limits choose or do not know of.
void check_limits(const Options& options) {
  options.refuse_if(true, "is chosen by --max-bytes, --min-db and --max-seconds",
                    {"--texels", "--views", "--lights", "--samples", "--bounces", "--lobes", "--no-table",
                     "--budget", "--half-lobes", "--float-tables"});
  // What a plan leaves out is not in the measured sizes and times.
  options.refuse_if(true, "excludes --max-bytes, --min-db and --max-seconds",
                    {"--quality", "--keep-samples", "--for"});
}

/// --max-bytes, --min-db and --max-seconds beside --quality, and the options that they exclude.
void add_choice(Options& options, MakeCommand& command) {
  MakeLimits& limits = command.limits;
  add_quality(options, command.quality);
  options.bytes("--max-bytes", limits.bytes, "Choose the settings: at most so many bytes (K, M: KiB, MiB)");
  options
      .number("--min-db", limits.held_out, "X",
              "Choose the settings: at least so many dB on held-out directions at 64x64 texels; the cheapest")
      .in(0, 200);
  options.number("--max-seconds", limits.seconds, "S", "Choose the settings: at most so long to bake and fit")
      .in(1e-3, 1e9);
  options.check([&options, &command] {
    if (command.limits.any()) {
      check_limits(options);
      // The knobs of the table's rows are laid over the paper's.
      (void)set_knobs(knobs_of(MakeOptions()), "", "", command.options);
      command.options.budget_texels = 0;
    } else {
      apply_quality(options, command.quality, command.options);
    }
  });
}

void declare(Options& options, MakeCommand& command) {
  options.common(command.common);
  add_cell(options, command.input, command.cell);
  add_bake(options, command.options.bake);
  add_fit(options, command.options);
  options.group("");
  const Option plan =
      options.text("--for", command.plan, "PLAN",
                   "Make only what this plan needs (selvedge plan): coarser texels, fewer levels");
  options
      .list("--material", command.materials, "NAME",
            "A material of the plan, by name or #index; may be repeated (default: all)")
      .needs(plan);
  options.text("--keep-samples", command.samples, "FILE", "Keep the samples in this file");
  options.output(command.output, "The fabric file").required();
  add_choice(options, command);
  options.check([&options, &command] {
    command.texels_given = options.given("--texels");
    command.sides_given = options.given("--sides");
    command.bounces_given = options.given("--bounces");
  });
}

void declare(Options& options, TradeCommand& command) {
  options.common(command.common);
  command.common.seed = 1;
  options.number("--seed", command.common.seed, "N", "Of all bakes");
  options.text("input", command.input, "STITCH", "As make takes it").required();
  add_settings(options, command.cell, &command.settings);
  options
      .text("-o,--output", command.output, "DIR",
            "A folder for points, pictures, fabrics and the page; a sweep in it goes on")
      .required();
  options.text("--grid", command.grid, "FILE",
               "The points to measure (JSON, docs/trade.md), instead of those that the presets are among");
  // Noise is estimated from two halves of equal size; pictures are halved separately.
  options.number("--repeats", command.repeats, "N", "Times are medians of so many runs").in(1, 99);
  options
      .number("--truth-samples", command.truth_samples, "N",
              "Rays a pixel of the true pictures, a multiple of 4")
      .in(4, 1 << 20);
  options.number("--held-out-pairs", command.held_out.pairs, "N", "Pairs of directions to measure errors by")
      .in(1, 65536);
  options
      .number("--held-out-samples", command.held_out.samples, "N", "Rays per texel and pair, an even number")
      .in(2, 1 << 20);
  options.size("--size", command.size, "Of the pictures", 22, 2048);
  options.flag("--keep-samples", command.keep_samples, "Keep the points' samples: large");
  options.check([&command] {
    if (command.truth_samples % 4 != 0)
      refuse("--truth-samples", fmt::format("{} is no multiple of 4", command.truth_samples));
    if (command.held_out.samples % 2 != 0)
      refuse("--held-out-samples", fmt::format("{} is no multiple of 2", command.held_out.samples));
    if (command.output == "-") refuse("--output", "is a folder");
    if (command.size.x > 4 * command.size.y) refuse("--size", "must be at most four times as wide as high");
  });
}

}  // namespace

void add_fit_verb(Program& program) {
  program.add<FitCommand>(
      {"fit", "Fit a fabric to samples: samples -> fabric", "selvedge fit k.samples.exr -o k.fabric.exr"},
      declare, run);
}

void add_make_verb(Program& program) {
  program.add<MakeCommand>({"make", "Stitch, bake and fit in one: stitch -> fabric",
                            "selvedge make plain-weave -o weave.fabric.exr"},
                           declare, run);
}

void add_trade_verb(Program& program) {
  program.add<TradeCommand>({"trade", "Measure what speed costs in accuracy: a sweep over the knobs",
                             "selvedge trade plain-knit -o trade-knit"},
                            declare, run);
}

}  // namespace selvedge
