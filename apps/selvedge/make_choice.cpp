#include "apps/selvedge/make_choice.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "apps/selvedge/option_groups.h"
#include "converter/presets/presets.h"

namespace selvedge {
namespace {

/// A number of the range; neither NaN nor infinite.
CLI::Validator is_between(double low, double high) {
  return CLI::Validator(
      [low, high](const std::string& text) {
        double value = 0;
        const bool good = CLI::detail::lexical_cast(text, value) && value >= low && value <= high;
        return good ? std::string() : fmt::format("{} is not a number in {} to {}", text, low, high);
      },
      fmt::format("in [{} - {}]", low, high));
}

void refuse(const CLI::App& make, const char* why, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (make.count(name) > 0) throw CLI::ValidationError(name, why);
  }
}

}  // namespace

void add_choice(CLI::App& app, MakeCommand& command) {
  MakeLimits& limits = command.limits;
  const char* group = "Speed against accuracy";
  app.add_option("--quality", command.quality,
                 "Settings that are worth their cost, or those of the paper; options given beside it stay as "
                 "given. Its budget grows with the texels")
      ->type_name("draft|standard|high|reference|paper")
      ->check(CLI::IsMember(std::vector<std::string>{"draft", "standard", "high", "reference", "paper"}))
      ->capture_default_str()
      ->group(group);
  app.add_option("--max-bytes", limits.bytes, "Choose the settings: at most so many bytes (K, M: KiB, MiB)")
      ->transform(byte_count())
      ->type_name("N")
      ->group(group);
  app.add_option(
         "--min-db", limits.held_out,
         "Choose the settings: at least so many dB on held-out directions at 64x64 texels; the cheapest")
      ->type_name("X")
      ->check(is_between(0, 200))
      ->group(group);
  app.add_option("--max-seconds", limits.seconds, "Choose the settings: at most so long to bake and fit")
      ->type_name("S")
      ->check(is_between(1e-3, 1e9))
      ->group(group);
}

void apply_choice(const CLI::App& make, MakeCommand& command) {
  if (command.limits.any()) {
    refuse(make, "is chosen by --max-bytes, --min-db and --max-seconds",
           {"--texels", "--views", "--lights", "--samples", "--noise", "--bounces", "--lobes", "--no-table",
            "--light-table", "--slabs", "--budget", "--half-lobes", "--float-tables", "--time-budget"});
    // What a plan leaves out is not in the measured sizes and times.
    refuse(make, "excludes --max-bytes, --min-db and --max-seconds",
           {"--quality", "--keep-samples", "--for", "--frames", "--glossy-slabs", "--slab-lobes", "--cells"});
    // The knobs of the table's rows are laid over the paper's.
    (void)set_knobs(knobs_of(MakeOptions()), "", "", command.options);
    command.options.budget_texels = 0;
    return;
  }
  const MakeOptions preset = *preset_named(command.quality);
  nlohmann::json knobs = knobs_of(preset);
  const auto given = [&](const std::string& option) { return make.count(option) > 0; };
  for (const char* knob : {"texels", "views", "lights", "samples", "bounces", "lobes", "budget"}) {
    if (given(std::string("--") + knob)) knobs.erase(knob);
  }
  // Layers go together: who asks for some by name has chosen them.
  if (given("--no-table") || given("--light-table")) {
    knobs.erase("layers");
    knobs.erase("budget");
  }
  if (given("--budget") && !preset.budget) knobs.erase("layers");
  if (given("--half-lobes") || given("--float-tables")) knobs.erase("storage");
  if (!given("--budget")) command.options.budget.reset();
  const int slabs = command.options.bake.slabs;
  (void)set_knobs(knobs, "", "", command.options);
  if (given("--slabs")) command.options.bake.slabs = slabs;
  // Yarns that need more texels have as many bytes for each.
  command.options.budget_texels = knobs.contains("budget") ? preset.budget_texels : 0;
}

}  // namespace selvedge
