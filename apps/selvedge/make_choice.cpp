#include "apps/selvedge/make_choice.h"

#include <array>
#include <nlohmann/json.hpp>

#include "converter/presets/presets.h"

namespace selvedge {
namespace {

/// Refuses options that the limits set or do not support.
void check_limits(const Options& options) {
  options.refuse_if(
      true, "is chosen by --max-bytes, --min-db and --max-seconds",
      {"--texels", "--views", "--lights", "--samples", "--noise", "--bounces", "--lobes", "--no-table",
       "--light-table", "--slabs", "--budget", "--half-lobes", "--float-tables", "--time-budget"});
  // Measured sizes and times do not account for a plan.
  options.refuse_if(
      true, "excludes --max-bytes, --min-db and --max-seconds",
      {"--quality", "--keep-samples", "--for", "--frames", "--glossy-slabs", "--slab-lobes", "--cells"});
}

/// Sets the knobs that are not on the command line to the preset's values.
void apply_preset(const Options& options, MakeCommand& command) {
  const MakeOptions preset = *preset_named(command.quality);
  nlohmann::json knobs = knobs_of(preset);
  for (const char* knob : {"texels", "views", "lights", "samples", "bounces", "lobes", "budget"}) {
    if (options.given((std::string("--") + knob).c_str())) knobs.erase(knob);
  }
  // A layer on the command line replaces the preset's choice of layers.
  if (options.given("--no-table") || options.given("--light-table")) {
    knobs.erase("layers");
    knobs.erase("budget");
  }
  if (options.given("--budget") && !preset.budget) knobs.erase("layers");
  if (options.given("--half-lobes") || options.given("--float-tables")) knobs.erase("storage");
  if (!options.given("--budget")) command.options.budget.reset();
  const int slabs = command.options.bake.slabs;
  (void)set_knobs(knobs, "", "", command.options);
  if (options.given("--slabs")) command.options.bake.slabs = slabs;
  // More texels, which fine yarns need, get more bytes in proportion.
  command.options.budget_texels = knobs.contains("budget") ? preset.budget_texels : 0;
}

}  // namespace

void add_choice(Options& options, MakeCommand& command) {
  MakeLimits& limits = command.limits;
  options.group("Speed against accuracy");
  static constexpr std::array<std::string_view, 5> names{"draft", "standard", "high", "reference", "paper"};
  options.choice(
      "--quality", names,
      "Settings that are worth their cost, or those of the paper; options given beside it stay as given. "
      "Its budget grows with the texels [standard]",
      [&command](std::size_t index) { command.quality = names[index]; });
  options.bytes("--max-bytes", limits.bytes, "Choose settings for at most this many bytes (K, M: KiB, MiB)");
  options
      .number("--min-db", limits.held_out, "X",
              "Choose the cheapest settings for at least this many dB on held-out directions at 64x64 texels")
      .in(0, 200);
  options
      .number("--max-seconds", limits.seconds, "S",
              "Choose settings for at most this many seconds to bake and fit")
      .in(1e-3, 1e9);
  options.check([&options, &command] {
    if (command.limits.any()) {
      check_limits(options);
      // Rows of the table override the paper's knobs.
      (void)set_knobs(knobs_of(MakeOptions()), "", "", command.options);
      command.options.budget_texels = 0;
    } else {
      apply_preset(options, command);
    }
  });
}

}  // namespace selvedge
