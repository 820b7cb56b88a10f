// trade: a sweep over the knobs of a make. All points are measured alike; an interrupted sweep goes on in its
// folder.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "apps/report/measure.h"
#include "apps/report/trade.h"
#include "apps/selvedge/bake.h"
#include "apps/selvedge/run_fit.h"
#include "converter/bake/setup.h"
#include "converter/bake/truth_swatch.h"
#include "converter/presets/held_out.h"
#include "format/base/atomic_file.h"
#include "format/base/option_text.h"
#include "format/picture/display.h"
#include "format/picture/swatch_picture.h"
#include "format/quality/compare.h"
#include "format/quality/picture_error.h"

namespace selvedge {
namespace {

using Points = std::vector<MakeOptions>;

Points points_of(const TradeCommand& command) {
  if (!command.grid.empty()) {
    constexpr std::uintmax_t max_bytes = std::uintmax_t{1} << 20;
    return must(read_grid(must(read_file(command.grid, max_bytes)), command.grid));
  }
  Points points;
  for (const MeasuredSetting& setting : measured_settings()) points.push_back(with_knobs(setting.knobs));
  return points;
}

/// Whether no fabric of the point is as small as its budget, or none can be chosen at all.
bool is_refused_budget(const MakeOptions& point, const Error& error) {
  return point.budget && error.code == Code::option_out_of_range &&
         (error.place == "--budget" || error.place == "budget");
}

class Sweep {
 public:
  explicit Sweep(const TradeCommand& command)
      : command_(command),
        silent_(command.common),
        folder_{command.output},
        progress_("trade", command.common.quiet) {
    silent_.quiet = true;
  }

  Result<void> run() {
    points_ = points_of(command_);
    auto cell = must(find_cell(command_.input, command_.cell));
    const V2i least = cell.stitch ? cell.stitch->min_texels : V2i(1, 1);
    const int min_texels = std::max(least.x, least.y);
    leave_out([&](const MakeOptions& point) {
      return point.bake.width < min_texels ? fmt::format("the stitch needs {} texels", min_texels) : "";
    });
    int texels = 1;
    for (const MakeOptions& point : points_) texels = std::max(texels, point.bake.width);
    must(claim(cell.mesh, texels));
    // Those that an earlier run could not make.
    leave_out([&](const MakeOptions& point) { return text_at(known(point), "leftOut"); });
    if (points_.empty()) return nothing_to_make();
    find_truth(cell.mesh, texels);
    measure();
    if (points_.empty()) return nothing_to_make();
    return write_trade_page(folder_, trade_);
  }

  std::size_t points() const { return points_.size(); }
  int measured() const { return measured_; }

 private:
  Result<void> nothing_to_make() const {
    return fail(Code::option_out_of_range, command_.input, "--grid", "has no point that can be made");
  }

  /// Takes points out of the sweep that there is a reason for, each with a line.
  void leave_out(const std::function<std::string(const MakeOptions&)>& reason) {
    std::erase_if(points_, [&](const MakeOptions& point) {
      const std::string why = reason(point);
      if (!why.empty() && !command_.common.quiet)
        report_remark(command_.input, fmt::format("{} is left out: {}", settings_name(point), why));
      return !why.empty();
    });
  }

  /// Reads the sweep in the folder, or begins one; refuses a folder with another sweep in it.
  Result<void> claim(const CellMesh& mesh, int texels) {
    // Points stand in one table only where all of this agrees.
    const Json identity = {
        {"software", "selvedge " SELVEDGE_VERSION},
        {"stitch", command_.input},
        {"settings", command_.settings},
        {"mesh", digest_of(mesh)},
        {"seed", command_.common.seed},
        {"repeats", command_.repeats},
        {"size", {command_.size.x, command_.size.y}},
        {"truthSamples", command_.truth_samples},
        {"heldOut",
         {{"texels", texels}, {"pairs", command_.held_out.pairs}, {"samples", command_.held_out.samples}}},
        {"places", digest_of_shots(mesh.period, command_.size.x, command_.size.y)},
        {"machine", machine_json()}};
    std::error_code error;
    const bool begun = std::filesystem::exists(folder_.record(), error);
    if (begun) {
      trade_ = must(read_trade(folder_));
      const Json begun_as = object_at(trade_, "identity");
      if (begun_as.empty())
        return fail(Code::file_damaged, folder_.record(), "", "is not the record of a sweep");
      for (const auto& [name, value] : identity.items()) {
        if (begun_as.value(name, Json()) != value)
          return fail(Code::option_out_of_range, folder_.record(), name,
                      "is another than that of the sweep in this folder: take a new one");
      }
    }
    for (const char* name : {"bakes", "fabrics", "truth", "pictures"}) {
      std::filesystem::create_directories(folder_.path + "/" + name, error);
      if (error) return fail(Code::file_unwritable, folder_.path, name, error.message());
    }
    for (const char* kind : {"points", "others"}) {
      for (const Json& record : array_at(trade_, kind)) records_[text_at(record, "name")] = record;
    }
    Json head = {{"program", "selvedge"},
                 {"report", 1},
                 {"verb", "trade"},
                 {"trade", 1},
                 {"identity", identity},
                 {"periodMm", {mesh.period.x, mesh.period.y}},
                 {"truth", object_at(trade_, "truth")},
                 {"bakes", object_at(trade_, "bakes")},
                 {"frames", array_at(trade_, "frames")},
                 {"usualFrames", array_at(trade_, "usualFrames")},
                 {"framePresets", object_at(trade_, "framePresets")}};
    trade_ = std::move(head);
    // Before anything is made: the files in the folder belong to this sweep from now on.
    save();
    return {};
  }

  /// The record of the sweep as far as it has come. Points of other grids and those that could not be made
  /// are kept beside those of this one.
  void save() {
    trade_["points"] = trade_["others"] = Json::array();
    Json others = records_;
    for (const MakeOptions& point : points_) {
      if (const Json record = known(point); !record.empty()) {
        trade_["points"].push_back(record);
        others.erase(settings_name(point));
      }
    }
    for (const Preset& preset : presets)
      trade_["presets"][std::string(preset.name)] = settings_name(with_knobs(preset.knobs));
    for (const auto& [name, record] : others.items()) trade_["others"].push_back(record);
    must(write_trade(folder_, trade_));
  }

  /// The true picture from one place, from its file if it is there; its noise goes into the record.
  Frame true_picture(const CellMesh& mesh, SwatchView view) {
    const std::string path = folder_.truth(name_of(view));
    Json& noise = trade_["truth"][std::string(name_of(view))];
    // A picture without noise has infinitely many decibels, which JSON has as null.
    const bool has_noise = noise.is_object() && noise.contains("noisePsnr") &&
                           (noise["noisePsnr"].is_number() || noise["noisePsnr"].is_null());
    if (const auto image = has_noise ? read_image(path + ".exr", Transfer::keep) : Image();
        image && image->width == command_.size.x && image->height == command_.size.y)
      return to_frame(*image);
    const SwatchShot shot = swatch_shot(view, mesh.period, command_.size.x, command_.size.y);
    TruthOptions options;
    options.samples = command_.truth_samples / 2;
    options.seed = mix(command_.common.seed) >> 1;
    auto a = must(trace_swatch(mesh, command_.input, shot, options));
    ++options.seed;
    const auto b = must(trace_swatch(mesh, command_.input, shot, options));
    Frame& frame = a.frame;
    const auto between = must(picture_error(frame, b.frame));
    for (std::size_t i = 0; i < frame.pixels.size(); ++i)
      frame.pixels[i] = (frame.pixels[i] + b.frame.pixels[i]) * 0.5F;
    // Two pictures of variance s^2 differ by 2 s^2; their mean has s^2 / 2.
    noise = {{"noisePsnr", psnr_of(between.mean_square / 4)}};
    must(write_exr(path + ".exr", to_linear_image(frame)));
    must(write_png(path + ".png", to_display_image(frame, default_display())));
    save();
    return std::move(frame);
  }

  void find_truth(const CellMesh& mesh, int texels) {
    period_mm_ = mesh.period;
    for (const SwatchView view : all_swatch_views) {
      progress_.note(fmt::format("the true picture {}", name_of(view)));
      pictures_.push_back(true_picture(mesh, view));
    }
    progress_.note("the held-out pairs");
    HeldOutOptions options = command_.held_out;
    options.texels = texels;
    BakeOptions base;
    base.seed = command_.common.seed;
    held_out_ =
        must(ensure_held_out(mesh, command_.input, options, base, folder_.truth("held-out.samples.exr")));
    trade_["peak"] = peak_of(held_out_);
    must(write_png(folder_.picture(trade_truth_picture), thumbnail_of(pictures_)));
    save();
  }

  std::string samples_of(const MakeOptions& point) const {
    return fmt::format("{}/bakes/{}.samples.exr", folder_.path, bake_name(point));
  }

  /// The point's record, or an empty object.
  Json known(const MakeOptions& point) const { return object_at(records_, settings_name(point).c_str()); }

  /// Whether the point's fabric and a record of it are there and whole; else it is measured again.
  bool is_measured(const MakeOptions& point) const {
    const std::string fabric = folder_.fabric(settings_name(point));
    const Json record = known(point);
    return is_whole(record, TradeKind::point) &&
           number_at(record, "/bytes") == static_cast<double>(size_of_file(fabric)) && read_fabric(fabric);
  }

  void measure() {
    Points left = points_;
    std::erase_if(left, [&](const MakeOptions& point) { return is_measured(point); });
    tidy_bakes(left);
    const Progress bar = progress_.callback();
    for (std::size_t i = 0; i < left.size(); ++i) {
      const MakeOptions& point = left[i];
      const std::string name = settings_name(point);
      progress_.note(name);
      try {
        const Json record = measure_point(point, name);
        ++measured_;
        records_[name] = record;
        if (!command_.common.quiet && !command_.common.json)
          fmt::print(stderr, "{}/{} {}: {:.2f} dB, SSIM {:.4f}, {:.0f} bytes, {:.2f} s\n", i + 1, left.size(),
                     name, number_at(record, trade_psnr), number_at(record, "/pictures/all/ssim"),
                     number_at(record, "/bytes"), number_at(record, "/seconds/make"));
      } catch (const Failure& failure) {
        // One that cannot be made does not end the sweep.
        if (!is_refused_budget(point, failure.error)) throw;
        const std::string why = failure.error.message;
        records_[name] = {{"name", name}, {"leftOut", why}};
        leave_out([&](const MakeOptions& other) { return settings_name(other) == name ? why : ""; });
      }
      if (bar) bar(static_cast<double>(i + 1) / static_cast<double>(left.size()));
      save();
      tidy_bakes({left.begin() + static_cast<std::ptrdiff_t>(i) + 1, left.end()});
    }
  }

  /// Removes from the folder of bakes the samples that no point needs any more, and what a sweep that was
  /// killed left half written.
  void tidy_bakes(const Points& left) const {
    std::error_code none;
    for (const auto& file : std::filesystem::directory_iterator(folder_.path + "/bakes", none)) {
      const bool needed = std::any_of(left.begin(), left.end(),
                                      [&](const auto& point) { return samples_of(point) == file.path(); });
      if (!needed && !(command_.keep_samples && file.path().string().ends_with(".samples.exr")))
        std::filesystem::remove(file.path(), none);
    }
  }

  /// The samples of the point in their file; the seconds that it took when they were baked.
  Seconds ensure_samples(const MakeOptions& point) {
    Json& time = trade_["bakes"][bake_name(point)];
    BakeCommand bake;
    bake.output = samples_of(point);
    std::error_code none;
    if (const Seconds there{number_at(time, "/seconds"), number_at(time, "/processorSeconds")};
        std::filesystem::exists(bake.output, none) && there.wall > 0 && there.processor > 0)
      return there;
    bake.input = command_.input;
    bake.cell = command_.cell;
    bake.bake = point.bake;
    bake.bake.seed = command_.common.seed;
    bake.bake.resumable = false;  // else a part may have been made in another run, whose time is not time
    bake.texels_given = true;
    const Seconds seconds =
        must(timed(command_.repeats, [&] { return must(bake_cell(bake, silent_)).seconds; }));
    time = {{"seconds", seconds.wall}, {"processorSeconds", seconds.processor}};
    save();
    return seconds;
  }

  /// Errors of every level, the finest of the held-out pairs first.
  Json held_out_json(const Fabric& fabric) const {
    const auto comparison =
        must(compare_with_finer(fabric, held_out_, PairKind::held_out, number_at(trade_, "/peak")));
    Json levels = Json::array();
    for (const LevelComparison& level : comparison.levels) {
      levels.push_back(
          {{"texels", {level.width, level.height}}, {"psnr", level.psnr}, {"relativeL2", level.relative_l2}});
    }
    return levels;
  }

  /// Errors of the pictures from the four places; the small ones go into the folder.
  Json pictures_json(const Fabric& fabric, const std::string& name) const {
    std::vector<Frame> frames;
    for (const SwatchView view : all_swatch_views)
      frames.push_back(draw_swatch(fabric, swatch_shot(view, period_mm_, command_.size.x, command_.size.y)));
    must(write_png(folder_.picture(name), thumbnail_of(frames)));
    return must(picture_errors_json(frames, pictures_));
  }

  /// Bakes the samples if they are not there yet, fits them, and measures the fabric. Bake and fit are
  /// repeated for the medians of their times.
  Json measure_point(const MakeOptions& point, const std::string& name) {
    const auto bake = ensure_samples(point);
    FitCommand fit;
    fit.input = samples_of(point);
    fit.common = silent_;
    fit.output = folder_.fabric(name);
    fit.options = point;
    const Seconds fitted = must(timed(command_.repeats, [&] { return fit_file(fit.input, fit).seconds; }));
    // All levels, as a viewer may need them; the file is in memory by now.
    Fabric fabric;
    const Seconds loaded = must(timed(std::max(5, command_.repeats), [&] {
      return clocked(
          [&] { return read_fabric(fit.output).map([&](Fabric&& read) { fabric = std::move(read); }); });
    }));
    std::string settings;
    for (const std::string& text : command_.settings) settings += " --set " + shell_word(text);
    return Json{{"name", name},
                {"knobs", knobs_of(point)},
                {"command", fmt::format("selvedge make {}{} --quality paper{} --seed {} -o {}.fabric.exr",
                                        shell_word(command_.input), settings, options_text(point),
                                        command_.common.seed, name)},
                {"bytes", size_of_file(fit.output)},
                {"seconds", {{"bake", bake.wall}, {"fit", fitted.wall}, {"make", bake.wall + fitted.wall}}},
                {"processorSeconds", bake.processor + fitted.processor},
                {"loadMs", 1000 * loaded.wall},
                {"heldOut", held_out_json(fabric)},
                {"pictures", pictures_json(fabric, name)}};
  }

  const TradeCommand& command_;
  CommonOptions silent_;
  TradeFolder folder_;
  TerminalProgress progress_;
  Points points_;
  Json trade_ = Json::object();    ///< what the folder's record has
  Json records_ = Json::object();  ///< of points by name, also of those that are not in this sweep
  V2d period_mm_{1, 1};
  std::vector<Frame> pictures_;  ///< the truth, of all_swatch_views
  PairSamples held_out_;
  int measured_ = 0;
};

}  // namespace

Result<int> run(const TradeCommand& command) {
  Sweep sweep(command);
  const auto seconds = must(clocked([&] { return sweep.run(); }));
  report(command.common, "trade",
         {{"input", command.input},
          {"output", command.output},
          {"points", sweep.points()},
          {"measured", sweep.measured()},
          {"seconds", seconds}},
         fmt::format("{} points, {} of them measured now, in {:.1f} s -> {}/index.html\n", sweep.points(),
                     sweep.measured(), seconds, command.output));
  return 0;
}

}  // namespace selvedge
