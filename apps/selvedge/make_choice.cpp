#include "apps/selvedge/make_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <vector>

#include "apps/selvedge/option_groups.h"
#include "converter/presets/presets.h"
#include "format/base/option_text.h"

namespace selvedge {
namespace {

/// Options of the knobs that a quality or limits choose.
constexpr std::array knob_options{"--texels",  "--views",      "--lights",       "--samples",     "--noise",
                                  "--bounces", "--lobes",      "--no-table",     "--light-table", "--slabs",
                                  "--budget",  "--half-lobes", "--float-tables", "--time-budget"};

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

}  // namespace

void add_choice(CLI::App& app, std::string& quality, MakeLimits& limits) {
  const char* group = "Speed against accuracy";
  app.add_option("--quality", quality,
                 "Settings that are worth their cost; options given beside it stay as given. A budget of "
                 "theirs grows "
                 "with the texels")
      ->type_name("draft|standard|high|reference")
      ->check(CLI::IsMember(std::vector<std::string>(quality_names.begin(), quality_names.end())))
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

void check_choice(const CLI::App& make, const MakeLimits& limits) {
  if (!limits.any()) return;
  for (const char* option : knob_options) {
    if (make.count(option) > 0)
      throw CLI::ValidationError(option, "is chosen by --max-bytes, --min-db and --max-seconds");
  }
  // What a plan leaves out is not in the measured sizes and times.
  for (const char* option :
       {"--quality", "--keep-samples", "--for", "--frames", "--glossy-slabs", "--slab-lobes", "--cells"}) {
    if (make.count(option) > 0)
      throw CLI::ValidationError(option, "excludes --max-bytes, --min-db and --max-seconds");
  }
}

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
  if (!given("--no-table") && !given("--light-table")) {
    if (!given("--slabs")) bake.slabs = wanted.slabs;
    command.fit.fit.view_table = fit.fit.view_table;
    command.fit.fit.light_table = fit.fit.light_table;
    if (!given("--budget") && point.budget > 0) command.fit.budget = point.budget;
  }
  if (!given("--half-lobes") && !given("--float-tables")) command.fit.write.half = fit.write.half;
}

}  // namespace selvedge
