#include "apps/selvedge/trade_point.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>

#include "apps/report/median.h"
#include "apps/report/trade_records.h"
#include "apps/selvedge/bake.h"
#include "apps/selvedge/run_fit.h"
#include "format/base/atomic_file.h"
#include "format/base/option_text.h"
#include "format/picture/swatch_picture.h"
#include "format/quality/compare.h"
#include "format/quality/picture_error.h"

namespace selvedge {
namespace {

/// By the clock, and the work of all cores, which other programs do not change.
struct Seconds {
  double wall = 0;
  double processor = 0;
};

/// The medians of so many runs, each of which gives its seconds by the clock; an error ends them.
template <class Run>
Result<Seconds> timed(int repeats, const Run& run) {
  std::vector<double> wall;
  std::vector<double> processor;
  for (int i = 0; i < repeats; ++i) {
    const std::clock_t work = std::clock();
    const Result<double> seconds = run();
    if (!seconds) return tl::unexpected(seconds.error());
    wall.push_back(*seconds);
    processor.push_back(static_cast<double>(std::clock() - work) / CLOCKS_PER_SEC);
  }
  return Seconds{median(wall), median(processor)};
}

CommonOptions silent(const TradeCommand& command) {
  CommonOptions common = command.common;
  common.quiet = true;
  return common;
}

/// The samples of the point in their file; the seconds that it took when they were baked.
Result<Seconds> ensure_samples(const TradeCommand& command, const MakeOptions& point,
                               const TradeFolder& folder) {
  const std::string record = folder.bake_record(point);
  std::error_code none;
  if (std::filesystem::exists(folder.samples(point), none)) {
    const auto there = read_trade_record(record);
    if (there && has_numbers(*there, {"/seconds", "/processorSeconds"}))
      return Seconds{number_at(*there, "/seconds"), number_at(*there, "/processorSeconds")};
  }
  BakeCommand bake;
  bake.input = command.input;
  bake.cell = command.cell;
  bake.bake = point.bake;
  bake.bake.seed = command.common.seed;
  bake.bake.resumable = false;  // else a part may have been made in another run, whose time is not known
  bake.texels_given = true;
  bake.output = folder.samples(point);
  auto seconds = timed(command.repeats, [&] {
    return bake_cell(bake, silent(command)).map([](const BakeReport& report) { return report.seconds; });
  });
  if (!seconds) return seconds;
  const Json json = {{"seconds", seconds->wall}, {"processorSeconds", seconds->processor}};
  if (auto ok = write_file(record, json.dump(2) + "\n"); !ok) return tl::unexpected(ok.error());
  return seconds;
}

/// Errors of every level, the finest of the held-out pairs first.
Result<Json> held_out_json(const Fabric& fabric, const TradeTruth& truth) {
  const auto comparison = compare_with_finer(fabric, truth.held_out, PairKind::held_out, truth.peak);
  if (!comparison) return tl::unexpected(comparison.error());
  Json levels = Json::array();
  for (const LevelComparison& level : comparison->levels) {
    levels.push_back(
        {{"texels", {level.width, level.height}}, {"psnr", level.psnr}, {"relativeL2", level.relative_l2}});
  }
  return levels;
}

/// Errors of the pictures from the four places; the small ones go to `picture`.
Result<Json> pictures_json(const Fabric& fabric, const TradeTruth& truth, const std::string& picture) {
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < all_swatch_views.size(); ++i) {
    const Frame& expected = truth.pictures[i];
    frames.push_back(draw_swatch(
        fabric, swatch_shot(all_swatch_views[i], truth.period_mm, expected.width, expected.height)));
  }
  if (auto ok = write_png(picture, thumbnail_of(frames)); !ok) return tl::unexpected(ok.error());
  return picture_errors_json(frames, truth.pictures);
}

}  // namespace

std::string TradeFolder::samples(const MakeOptions& p) const {
  return fmt::format("{}/bakes/{}.samples.exr", path, bake_name(p));
}
std::string TradeFolder::bake_record(const MakeOptions& p) const {
  return fmt::format("{}/bakes/{}.json", path, bake_name(p));
}
std::string TradeFolder::fabric(const MakeOptions& p) const {
  return fmt::format("{}/fabrics/{}.fabric.exr", path, settings_name(p));
}
std::string TradeFolder::record(const MakeOptions& p) const {
  return fmt::format("{}/points/{}.json", path, settings_name(p));
}
std::string TradeFolder::picture(const std::string& name) const {
  return fmt::format("{}/pictures/{}.png", path, name);
}

Result<Json> measure_point(const TradeCommand& command, const MakeOptions& point, const TradeFolder& folder,
                           const TradeTruth& truth) {
  const auto bake = ensure_samples(command, point, folder);
  if (!bake) return tl::unexpected(bake.error());
  FitCommand fit;
  fit.input = folder.samples(point);
  fit.common = silent(command);
  fit.output = folder.fabric(point);
  fit.options = point;
  const auto fitted = timed(command.repeats, [&] {
    return fit_file(fit.input, fit).map([](const FitOutcome& outcome) { return outcome.seconds; });
  });
  if (!fitted) return tl::unexpected(fitted.error());
  // All levels, as a viewer may need them; the file is in memory by now.
  Fabric fabric;
  const auto loaded = timed(std::max(5, command.repeats), [&]() -> Result<double> {
    const auto start = std::chrono::steady_clock::now();
    auto read = read_fabric(fit.output);
    if (!read) return tl::unexpected(read.error());
    fabric = std::move(*read);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  });
  if (!loaded) return tl::unexpected(loaded.error());
  const auto held_out = held_out_json(fabric, truth);
  if (!held_out) return tl::unexpected(held_out.error());
  const std::string name = settings_name(point);
  const auto pictures = pictures_json(fabric, truth, folder.picture(name));
  if (!pictures) return tl::unexpected(pictures.error());
  std::string settings;
  for (const std::string& text : command.settings) settings += " --set " + shell_word(text);
  Json json = {
      {"name", name},
      {"knobs", knobs_of(point)},
      {"command",
       fmt::format("selvedge make {}{} --quality paper{} --seed {} -o {}.fabric.exr",
                   shell_word(command.input), settings, options_text(point), command.common.seed, name)},
      {"bytes", size_of_file(fit.output)},
      {"seconds", {{"bake", bake->wall}, {"fit", fitted->wall}, {"make", bake->wall + fitted->wall}}},
      {"processorSeconds", bake->processor + fitted->processor},
      {"loadMs", 1000 * loaded->wall},
      {"heldOut", *held_out},
      {"pictures", *pictures}};
  if (auto ok = write_file(folder.record(point), json.dump(2) + "\n"); !ok) return tl::unexpected(ok.error());
  return json;
}

}  // namespace selvedge
