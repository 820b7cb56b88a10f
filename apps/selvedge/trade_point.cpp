#include "apps/selvedge/trade_point.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>

#include "apps/report/median.h"
#include "apps/selvedge/bake.h"
#include "apps/selvedge/run_fit.h"
#include "format/base/atomic_file.h"
#include "format/base/json_text.h"
#include "format/base/option_text.h"
#include "format/picture/swatch_picture.h"

namespace selvedge {
namespace {

CommonOptions silent(const TradeCommand& command) {
  CommonOptions common = command.common;
  common.quiet = true;
  return common;
}

/// Seconds by the clock and of all cores' work, of runs.
struct Times {
  std::vector<double> wall;
  std::vector<double> processor;
};

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Opening and reading everything, as a viewer does that needs all levels; the file is in memory by then.
Result<double> seconds_to_load(const std::string& path, int repeats) {
  constexpr int least = 5;
  std::vector<double> seconds;
  for (int i = 0; i < std::max(least, repeats); ++i) {
    const auto start = std::chrono::steady_clock::now();
    auto reader = FabricReader::open(path);
    if (!reader) return tl::unexpected(reader.error());
    if (const auto fabric = reader->read(); !fabric) return tl::unexpected(fabric.error());
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return median(seconds);
}

Result<Fabric> load(const std::string& path) {
  auto reader = FabricReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  return reader->read();
}

/// Figures of every level, the finest of the held-out pairs first.
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

/// Errors of the pictures, by view and as one; the small ones go to `picture`.
Result<Json> pictures_json(const Fabric& fabric, const TradeTruth& truth, const std::string& picture) {
  std::vector<PictureError> errors;
  std::vector<Frame> frames;
  Json json = Json::object();
  for (std::size_t i = 0; i < all_swatch_views.size(); ++i) {
    const Frame& expected = truth.pictures[i];
    const SwatchShot shot =
        swatch_shot(all_swatch_views[i], truth.period_mm, expected.width, expected.height);
    frames.push_back(draw_swatch(fabric, shot));
    const auto error = picture_error(frames.back(), expected);
    if (!error) return tl::unexpected(error.error());
    errors.push_back(*error);
    json[std::string(swatch_view_names[i])] = {{"psnr", psnr_of(error->mean_square)}, {"ssim", error->ssim}};
  }
  const PictureError mean = mean_of(errors);
  json["all"] = {{"psnr", psnr_of(mean.mean_square)}, {"ssim", mean.ssim}};
  if (auto ok = write_png(picture, thumbnail_of(frames)); !ok) return tl::unexpected(ok.error());
  return json;
}

}  // namespace

std::string TradeFolder::samples(const TradePoint& p) const {
  return fmt::format("{}/bakes/{}.samples.exr", path, bake_name_of(p));
}
std::string TradeFolder::bake_record(const TradePoint& p) const {
  return fmt::format("{}/bakes/{}.json", path, bake_name_of(p));
}
std::string TradeFolder::fabric(const TradePoint& p) const {
  return fmt::format("{}/fabrics/{}.fabric.exr", path, name_of(p));
}
std::string TradeFolder::record(const TradePoint& p) const {
  return fmt::format("{}/points/{}.json", path, name_of(p));
}
std::string TradeFolder::picture(const std::string& name) const {
  return fmt::format("{}/pictures/{}.png", path, name);
}

std::string make_line(const TradeCommand& command, const TradePoint& point) {
  std::string settings;
  for (const std::string& text : command.settings) settings += " --set " + shell_word(text);
  return fmt::format("selvedge make {}{}{} --seed {} -o {}.fabric.exr", shell_word(command.input), settings,
                     options_text(point), command.common.seed, name_of(point));
}

Result<MakeSeconds> ensure_samples(const TradeCommand& command, const TradePoint& point,
                                   const TradeFolder& folder) {
  const std::string samples = folder.samples(point);
  const std::string record = folder.bake_record(point);
  std::error_code none;
  if (std::filesystem::exists(samples, none)) {
    if (const auto text = read_file(record)) {
      nlohmann::json json = parse_json(*text);
      if (json.is_object() && json["seconds"].is_number() && json["processorSeconds"].is_number())
        return MakeSeconds{json["seconds"].get<double>(), json["processorSeconds"].get<double>()};
    }
  }
  BakeCommand bake;
  bake.input = command.input;
  bake.cell = command.cell;
  bake.bake = bake_options_of(point, command.common.seed);
  bake.texels_given = true;
  bake.output = samples;
  bake.bake.resumable = false;  // a time that began in another run is none
  Times times;
  for (int i = 0; i < command.repeats; ++i) {
    const double before = processor_seconds();
    const auto baked = bake_cell(bake, silent(command));
    if (!baked) return tl::unexpected(baked.error());
    times.wall.push_back(baked->seconds);
    times.processor.push_back(processor_seconds() - before);
  }
  const MakeSeconds seconds{median(times.wall), median(times.processor)};
  const Json json = {
      {"seconds", seconds.wall}, {"processorSeconds", seconds.processor}, {"runs", times.wall}};
  if (auto ok = write_file(record, json.dump(2) + "\n"); !ok) return tl::unexpected(ok.error());
  return seconds;
}

Result<Json> measure_point(const TradeCommand& command, const TradePoint& point, const TradeFolder& folder,
                           const TradeTruth& truth, const MakeSeconds& bake) {
  FitCommand fit;
  fit.input = folder.samples(point);
  fit.common = silent(command);
  fit.output = folder.fabric(point);
  const TradeFit options = fit_options_of(point);
  fit.fit = options.fit;
  fit.write = options.write;
  if (point.budget > 0) fit.budget = point.budget;
  Times times;
  for (int i = 0; i < command.repeats; ++i) {
    const double before = processor_seconds();
    const auto fitted = fit_file(fit.input, fit);
    if (!fitted) return tl::unexpected(fitted.error());
    times.wall.push_back(fitted->seconds);
    times.processor.push_back(processor_seconds() - before);
  }
  const auto load_seconds = seconds_to_load(fit.output, command.repeats);
  if (!load_seconds) return tl::unexpected(load_seconds.error());
  const auto fabric = load(fit.output);
  if (!fabric) return tl::unexpected(fabric.error());
  const auto held_out = held_out_json(*fabric, truth);
  if (!held_out) return tl::unexpected(held_out.error());
  const auto pictures = pictures_json(*fabric, truth, folder.picture(name_of(point)));
  if (!pictures) return tl::unexpected(pictures.error());
  const double fit_seconds = median(times.wall);
  Json json = {{"name", name_of(point)},
               {"knobs", Json::parse(knobs_json(point))},
               {"command", make_line(command, point)},
               {"bytes", size_of_file(fit.output)},
               {"seconds", {{"bake", bake.wall}, {"fit", fit_seconds}, {"make", bake.wall + fit_seconds}}},
               {"processorSeconds", bake.processor + median(times.processor)},
               {"loadMs", 1000 * *load_seconds},
               {"heldOut", *held_out},
               {"pictures", *pictures}};
  if (auto ok = write_file(folder.record(point), json.dump(2) + "\n"); !ok) return tl::unexpected(ok.error());
  return json;
}

}  // namespace selvedge
