// trade: a sweep over the knobs of a make. All points are measured alike; an interrupted sweep goes on in its
// folder.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>

#include "apps/report/machine.h"
#include "apps/report/trade_page.h"
#include "apps/report/trade_records.h"
#include "apps/selvedge/trade_point.h"
#include "converter/bake/setup.h"
#include "converter/bake/truth_swatch.h"
#include "converter/presets/held_out.h"
#include "converter/presets/presets.h"
#include "format/base/atomic_file.h"
#include "format/base/digest.h"
#include "format/base/parallel.h"
#include "format/picture/display.h"
#include "format/quality/compare.h"
#include "format/quality/picture_error.h"
#include "format/scene/swatch.h"

namespace selvedge {
namespace {

using Points = std::vector<MakeOptions>;

Result<Points> points_of(const TradeCommand& command) {
  if (!command.grid.empty()) {
    constexpr std::uintmax_t max_bytes = std::uintmax_t{1} << 20;
    const auto text = read_file(command.grid, max_bytes);
    if (!text) return tl::unexpected(text.error());
    return read_grid(*text, command.grid);
  }
  Points points;
  for (const MeasuredSetting& setting : measured_settings()) points.push_back(with_knobs(setting.knobs));
  return points;
}

int finest(const Points& points) {
  int texels = 1;
  for (const MakeOptions& point : points) texels = std::max(texels, point.bake.width);
  return texels;
}

/// Points stand in one table only where all of this agrees.
Json identity_of(const TradeCommand& command, const CellMesh& mesh, int texels) {
  return {{"software", "selvedge " SELVEDGE_VERSION},
          {"stitch", command.input},
          {"settings", command.settings},
          {"mesh", digest_of(mesh)},
          {"seed", command.common.seed},
          {"repeats", command.repeats},
          {"size", {command.size.x, command.size.y}},
          {"truthSamples", command.truth_samples},
          {"heldOut",
           {{"texels", texels}, {"pairs", command.held_out_pairs}, {"samples", command.held_out_samples}}},
          {"places", digest_of_shots(mesh.period, command.size.x, command.size.y)},
          {"machine", machine_json()}};
}

/// Refuses a folder with another sweep in it.
Result<void> claim(const TradeFolder& folder, const Json& identity) {
  const std::string path = folder.path + "/" + trade_sweep_file;
  std::error_code error;
  const bool begun = std::filesystem::exists(path, error);
  if (begun) {
    const auto there = read_trade_record(path);
    if (!there) return tl::unexpected(there.error());
    const Json known = object_at(*there, "identity");
    if (known.empty()) return fail(Code::file_damaged, path, "", "is not the record of a sweep");
    for (const auto& [name, value] : identity.items()) {
      if (known.value(name, Json()) != value)
        return fail(Code::option_out_of_range, path, name,
                    "is another than that of the sweep in this folder: take a new one");
    }
  }
  for (const char* name : {"bakes", "fabrics", "truth", trade_points_folder, trade_pictures_folder}) {
    std::filesystem::create_directories(folder.path + "/" + name, error);
    if (error) return fail(Code::file_unwritable, folder.path, name, error.message());
  }
  if (begun) return {};
  // Before anything is made: the files in the folder belong to this sweep from now on.
  const Json claimed = {{"trade", 1}, {"identity", identity}};
  return write_file(path, claimed.dump(2) + "\n");
}

/// A true picture that an interrupted sweep left, if it is whole.
std::optional<Frame> picture_there(const TradeCommand& command, const std::string& path,
                                   const std::string& record, Json& noise) {
  const auto json = read_trade_record(record);
  if (!json || !json->contains("noisePsnr")) return std::nullopt;
  // A picture without noise has infinitely many decibels, which JSON has as null.
  const Json psnr = (*json)["noisePsnr"];
  if (!psnr.is_number() && !psnr.is_null()) return std::nullopt;
  const auto image = read_image(path, Transfer::keep);
  if (!image || image->width != command.size.x || image->height != command.size.y) return std::nullopt;
  noise = {{"noisePsnr", psnr}};
  return to_frame(*image);
}

/// The true picture from one place, from its file if it is there; its noise goes beside it.
Result<Frame> true_picture(const TradeCommand& command, const CellMesh& mesh, SwatchView view,
                           const TradeFolder& folder, Json& noise) {
  const std::string path = fmt::format("{}/truth/{}", folder.path, name_of(view));
  if (auto there = picture_there(command, path + ".exr", path + ".json", noise)) return std::move(*there);
  const SwatchShot shot = swatch_shot(view, mesh.period, command.size.x, command.size.y);
  TruthOptions options;
  options.samples = command.truth_samples / 2;
  options.seed = mix(command.common.seed) >> 1;
  auto a = trace_swatch(mesh, command.input, shot, options);
  if (!a) return tl::unexpected(a.error());
  ++options.seed;
  const auto b = trace_swatch(mesh, command.input, shot, options);
  if (!b) return tl::unexpected(b.error());
  Frame& frame = a->frame;
  const auto between = picture_error(frame, b->frame);
  if (!between) return tl::unexpected(between.error());
  for (std::size_t i = 0; i < frame.pixels.size(); ++i)
    frame.pixels[i] = (frame.pixels[i] + b->frame.pixels[i]) * 0.5F;
  // Two pictures of variance s^2 differ by 2 s^2; their mean has s^2 / 2.
  noise = {{"noisePsnr", psnr_of(between->mean_square / 4)}};
  if (auto ok = write_exr(path + ".exr", to_linear_image(frame)); !ok) return tl::unexpected(ok.error());
  if (auto ok = write_png(path + ".png", to_display_image(frame, default_display())); !ok)
    return tl::unexpected(ok.error());
  if (auto ok = write_file(path + ".json", noise.dump(2) + "\n"); !ok) return tl::unexpected(ok.error());
  return std::move(frame);
}

/// Whether the point's fabric and a record of it are there and whole; else it is measured again.
bool is_measured(const TradeFolder& folder, const MakeOptions& point) {
  const auto record = read_trade_record(folder.record(point));
  return record && is_point_record(*record, settings_name(point)) &&
         number_at(*record, "/bytes") == static_cast<double>(size_of_file(folder.fabric(point))) &&
         read_fabric(folder.fabric(point));
}

/// Why an earlier run could not make the point; empty where it was not tried.
std::string why_left_out(const TradeFolder& folder, const MakeOptions& point) {
  const auto record = read_trade_record(folder.record(point));
  return record && text_at(*record, "name") == settings_name(point) ? text_at(*record, "leftOut") : "";
}

/// Whether no fabric of the point is as small as its budget, or none can be chosen at all.
bool is_refused_budget(const MakeOptions& point, const Error& error) {
  return point.budget && error.code == Code::option_out_of_range &&
         (error.place == "--budget" || error.place == "budget");
}

class Sweep {
 public:
  explicit Sweep(const TradeCommand& command)
      : command_(command), folder_{command.output}, progress_("trade", command.common.quiet) {}

  Result<void> run() {
    auto points = points_of(command_);
    if (!points) return tl::unexpected(points.error());
    points_ = std::move(*points);
    auto cell = find_cell(command_.input, command_.cell);
    if (!cell) return tl::unexpected(cell.error());
    if (auto ok = leave_out_too_coarse(*cell); !ok) return ok;
    const int texels = finest(points_);
    identity_ = identity_of(command_, cell->mesh, texels);
    if (auto ok = claim(folder_, identity_); !ok) return ok;
    // Those that an earlier run could not make.
    std::erase_if(points_, [&](const MakeOptions& point) {
      const std::string why = why_left_out(folder_, point);
      if (!why.empty()) report_left_out(point, why);
      return !why.empty();
    });
    if (auto ok = find_truth(cell->mesh, texels); !ok) return ok;
    if (auto ok = measure(); !ok) return ok;
    if (points_.empty())
      return fail(Code::option_out_of_range, command_.input, "--grid", "has no point that can be made");
    return write_trade_page(folder_.path);
  }

  std::size_t points() const { return points_.size(); }
  int measured() const { return measured_; }

 private:
  /// Points of fewer texels than the stitch can be baked with.
  Result<void> leave_out_too_coarse(const Cell& cell) {
    if (!cell.stitch) return {};
    const int min_texels = std::max(cell.stitch->min_texels.x, cell.stitch->min_texels.y);
    if (std::erase_if(points_, [&](const MakeOptions& p) { return p.bake.width < min_texels; }) == 0)
      return {};
    if (points_.empty()) {
      return fail(Code::option_out_of_range, command_.input, "--grid",
                  fmt::format("has no point of {} texels or more, which this stitch needs", min_texels));
    }
    if (!command_.common.quiet)
      report_remark(command_.input, fmt::format("points of fewer than {} texels are left out", min_texels));
    return {};
  }

  void report_left_out(const MakeOptions& point, const std::string& why) const {
    if (!command_.common.quiet)
      report_remark(command_.input, fmt::format("{} is left out: {}", settings_name(point), why));
  }

  Result<void> find_truth(const CellMesh& mesh, int texels) {
    truth_.period_mm = mesh.period;
    for (const SwatchView view : all_swatch_views) {
      progress_.note(fmt::format("the true picture {}", name_of(view)));
      auto picture = true_picture(command_, mesh, view, folder_, noise_[std::string(name_of(view))]);
      if (!picture) return tl::unexpected(picture.error());
      truth_.pictures.push_back(std::move(*picture));
    }
    progress_.note("the held-out pairs");
    const std::string path = folder_.path + "/truth/held-out.samples.exr";
    const HeldOutOptions options{texels, command_.held_out_pairs, command_.held_out_samples};
    BakeOptions base;
    base.seed = command_.common.seed;
    auto pairs = read_held_out(path, options);
    if (!pairs) {
      auto baked = bake_held_out(mesh, command_.input, options, base, path);
      if (!baked) return tl::unexpected(baked.error());
      pairs = std::move(*baked);
    }
    truth_.held_out = std::move(*pairs);
    truth_.peak = peak_of(truth_.held_out);
    if (auto ok = write_png(folder_.picture(trade_truth_picture), thumbnail_of(truth_.pictures)); !ok)
      return ok;
    return write_sweep();
  }

  Result<void> write_sweep() const {
    Json names = Json::array();
    for (const MakeOptions& point : points_) names.push_back(settings_name(point));
    Json preset_names = Json::object();
    for (const Preset& preset : presets)
      preset_names[std::string(preset.name)] = settings_name(with_knobs(preset.knobs));
    const Json sweep = {{"trade", 1},
                        {"identity", identity_},
                        {"periodMm", {truth_.period_mm.x, truth_.period_mm.y}},
                        {"truth", noise_},
                        {"peak", truth_.peak},
                        {"points", names},
                        {"presets", preset_names}};
    return write_file(folder_.path + "/" + trade_sweep_file, sweep.dump(2) + "\n");
  }

  /// Points that are not measured, those of one bake after each other, so that its samples can go.
  Points points_left() const {
    Points left = points_;
    std::erase_if(left, [&](const MakeOptions& point) { return is_measured(folder_, point); });
    const auto first_of_bake = [&, all = left](const MakeOptions& point) {
      return std::find_if(all.begin(), all.end(),
                          [&](const auto& other) { return bake_name(other) == bake_name(point); }) -
             all.begin();
    };
    std::stable_sort(left.begin(), left.end(), [&](const MakeOptions& a, const MakeOptions& b) {
      return first_of_bake(a) < first_of_bake(b);
    });
    return left;
  }

  Result<void> measure() {
    const Points left = points_left();
    tidy_bakes(left);
    const Progress bar = progress_.callback();
    for (std::size_t i = 0; i < left.size(); ++i) {
      const MakeOptions& point = left[i];
      progress_.note(settings_name(point));
      const auto record = measure_point(command_, point, folder_, truth_);
      if (!record && !is_refused_budget(point, record.error())) return tl::unexpected(record.error());
      std::error_code none;
      const bool last_of_bake = i + 1 == left.size() || bake_name(left[i + 1]) != bake_name(point);
      if (last_of_bake && !command_.keep_samples) std::filesystem::remove(folder_.samples(point), none);
      if (bar) bar(static_cast<double>(i + 1) / static_cast<double>(left.size()));
      if (record) {
        ++measured_;
        report_point(*record, i + 1, left.size());
      } else if (auto ok = leave_out(point, record.error().message); !ok) {
        return ok;
      }
    }
    return {};
  }

  /// The point is no longer one of the sweep's; one that cannot be made does not end it.
  Result<void> leave_out(const MakeOptions& point, const std::string& why) {
    const std::string name = settings_name(point);
    report_left_out(point, why);
    std::erase_if(points_, [&](const MakeOptions& other) { return settings_name(other) == name; });
    if (auto ok = write_sweep(); !ok) return ok;
    return write_file(folder_.record(point), Json{{"name", name}, {"leftOut", why}}.dump(2) + "\n");
  }

  /// Removes what a sweep that was killed left in the folder of bakes: files half written, and samples that
  /// no point needs any more.
  void tidy_bakes(const Points& left) const {
    for (const MakeOptions& point : points_) {
      const std::string samples = folder_.samples(point);
      const bool needed = command_.keep_samples || std::any_of(left.begin(), left.end(), [&](const auto& p) {
                            return folder_.samples(p) == samples;
                          });
      std::error_code none;
      if (!needed) std::filesystem::remove(samples, none);
      // Beginning a file removes what others left of it.
      for (const char* ending : {"", ".journal"}) (void)AtomicFile::create(samples + ending);
    }
  }

  void report_point(const Json& record, std::size_t done, std::size_t all) const {
    if (command_.common.quiet || command_.common.json) return;
    fmt::print(stderr, "{}/{} {}: {:.2f} dB, SSIM {:.4f}, {:.0f} bytes, {:.2f} s\n", done, all,
               text_at(record, "name"), number_at(record, "/pictures/all/psnr"),
               number_at(record, "/pictures/all/ssim"), number_at(record, "/bytes"),
               number_at(record, "/seconds/make"));
  }

  const TradeCommand& command_;
  TradeFolder folder_;
  TerminalProgress progress_;
  Points points_;
  Json identity_;
  Json noise_ = Json::object();  ///< of the true pictures
  TradeTruth truth_;
  int measured_ = 0;
};

}  // namespace

Result<int> run(const TradeCommand& command) {
  const auto start = std::chrono::steady_clock::now();
  Sweep sweep(command);
  if (auto ok = sweep.run(); !ok) return tl::unexpected(ok.error());
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
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
