#include "apps/selvedge/make_choice.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "converter/presets/presets.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

/// MakeCommand::given of what the command line has.
std::string given_options(const CLI::App& make) {
  // What is chosen, where things go, and how they are told; threads do not change a byte.
  constexpr std::array others{"--max-bytes", "--min-db", "--max-seconds", "--output",
                              "--report",    "--json",   "--quiet",       "--threads"};
  std::string text;
  for (const CLI::Option* option : make.get_options()) {
    if (option->get_lnames().empty() || option->count() == 0) continue;
    const std::string name = "--" + option->get_lnames().front();
    if (std::find(others.begin(), others.end(), name) != others.end()) continue;
    const bool is_flag = option->get_items_expected_max() == 0;
    for (const std::string& value : option->results())
      text += " " + name + (is_flag ? "" : " " + shell_word(value));
  }
  return text;
}

/// Refuses options that the limits choose or do not know of.
void check_limits(const Options& options) {
  options.refuse_if(
      true, "is chosen by --max-bytes, --min-db and --max-seconds",
      {"--texels", "--views", "--lights", "--samples", "--noise", "--bounces", "--lobes", "--no-table",
       "--light-table", "--slabs", "--budget", "--half-lobes", "--float-tables", "--time-budget"});
  // What a plan leaves out is not in the measured sizes and times.
  options.refuse_if(true, "excludes --max-bytes, --min-db and --max-seconds",
                    {"--quality", "--keep-samples", "--for", "--products", "--frames", "--glossy-slabs",
                     "--slab-lobes", "--cells"});
}

}  // namespace

void add_choice(Options& options, MakeCommand& command) {
  MakeLimits& limits = command.limits;
  options.group("Speed against accuracy");
  options.choice(
      "--quality", quality_names,
      "Settings that are worth their cost; options given beside it stay as given. A budget of theirs "
      "grows with the texels",
      [&command](std::size_t index) { command.quality = quality_names[index]; });
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
      command.given = given_options(options.app());
    }
    const auto chosen = quality_named(command.quality);
    if (!chosen) return;
    const TradePoint point = point_of(*chosen);
    set_knobs(
        point, [&options](const char* option) { return options.given(option); }, command);
    // Yarns that need more texels have as many bytes for each.
    if (!options.given("--budget")) command.fit.budget_texels = point.texels * point.texels;
  });
}

void set_knobs(const TradePoint& point, const std::function<bool(const char*)>& given, MakeCommand& command) {
  BakeOptions& bake = command.bake.bake;
  const BakeOptions wanted = bake_options_of(point, bake.seed);
  if (!given("--texels")) {
    bake.width = wanted.width;
    bake.height = wanted.height;
  }
  if (!given("--views")) bake.views = wanted.views;
  if (!given("--lights")) bake.lights = wanted.lights;
  if (!given("--samples")) bake.samples = wanted.samples;
  if (!given("--bounces")) bake.bounces = wanted.bounces;
  const TradeFit fit = fit_options_of(point);
  if (!given("--lobes")) command.fit.fit.lobes = fit.fit.lobes;
  // Layers go together: who asks for some by name has chosen them.
  if (!given("--no-table") && !given("--light-table") && !given("--products")) {
    if (!given("--slabs")) bake.slabs = wanted.slabs;
    command.fit.fit.view_table = fit.fit.view_table;
    command.fit.fit.light_table = fit.fit.light_table;
    if (!given("--budget") && point.budget > 0) command.fit.budget = point.budget;
  }
  if (!given("--half-lobes") && !given("--float-tables")) command.fit.write.half = fit.write.half;
}

}  // namespace selvedge
