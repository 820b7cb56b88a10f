// trade: a sweep over the knobs of the road from stitch to fabric, all points judged alike. What is done
// stays in the folder; an interrupted sweep goes on there.
#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <optional>

#include "apps/report/machine.h"
#include "apps/report/trade_page.h"
#include "apps/report/trade_records.h"
#include "apps/selvedge/trade_point.h"
#include "converter/bake/setup.h"
#include "converter/bake/truth_swatch.h"
#include "converter/presets/presets.h"
#include "format/base/atomic_file.h"
#include "format/base/digest.h"
#include "format/base/json_text.h"
#include "format/picture/display.h"
#include "format/scene/swatch.h"

namespace selvedge {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

int finest(const std::vector<TradePoint>& points) {
  int texels = 1;
  for (const TradePoint& point : points) texels = std::max(texels, point.texels);
  return texels;
}

Result<std::vector<TradePoint>> points_of(const TradeCommand& command) {
  if (command.grid.empty()) return default_grid();
  constexpr std::uintmax_t most = std::uintmax_t{1} << 20;
  const auto text = read_file(command.grid, most);
  if (!text) return tl::unexpected(text.error());
  return read_grid(*text, command.grid);
}

/// In seconds of some machine: what the estimate of the time left goes by.
double cost_of(const TradePoint& p) {
  const double texels = static_cast<double>(p.texels) * p.texels;
  const double pairs = static_cast<double>(p.views) * p.lights;
  const double bake = texels * (pairs * p.samples + 224.0 * 64) / 20e6;
  const double fit = texels * pairs * 0.5e-6 * (p.budget > 0 ? 6 : 1);
  return bake + fit + 1;
}

/// What has to agree for points to stand in one table.
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
  // Before anything is made: what lies in the folder belongs to this sweep from now on.
  const Json claimed = {{"trade", 1}, {"identity", identity}};
  return write_file(path, claimed.dump(2) + "\n");
}

/// A true picture, twice as noisy, from one seed.
Result<Frame> trace_half(const TradeCommand& command, const CellMesh& mesh, const SwatchShot& shot,
                         std::uint64_t seed) {
  TruthOptions options;
  options.samples = command.truth_samples / 2;
  options.seed = seed;
  auto swatch = trace_swatch(mesh, command.input, shot, options);
  if (!swatch) return tl::unexpected(swatch.error());
  return std::move(swatch->frame);
}

/// A JSON object in a file; discarded where there is none.
nlohmann::json read_json(const std::string& path) {
  const auto text = read_file(path);
  return parse_json(text ? *text : std::string());
}

/// A true picture that an interrupted sweep left, if it is whole; what is damaged is traced anew.
std::optional<Frame> picture_there(const TradeCommand& command, const std::string& path,
                                   const std::string& record, Json& noise) {
  const auto json = read_json(record);
  if (!json.is_object() || !json.contains("noisePsnr")) return std::nullopt;
  // No number: infinitely many decibels, of a picture without noise.
  const auto& psnr = json["noisePsnr"];
  if (!psnr.is_number() && !psnr.is_null()) return std::nullopt;
  const auto image = read_image(path, Transfer::keep);
  if (!image || image->width != command.size.x || image->height != command.size.y) return std::nullopt;
  noise = {{"noisePsnr", psnr}};
  return to_frame(*image);
}

/// The true picture from one place, from its file if it is there; its noise goes beside it.
Result<Frame> true_picture(const TradeCommand& command, const CellMesh& mesh, SwatchView view,
                           const TradeFolder& folder, Json& noise) {
  const std::string path = fmt::format("{}/truth/{}.exr", folder.path, name_of(view));
  const std::string record = fmt::format("{}/truth/{}.json", folder.path, name_of(view));
  if (auto there = picture_there(command, path, record, noise)) return std::move(*there);
  const SwatchShot shot = swatch_shot(view, mesh.period, command.size.x, command.size.y);
  const std::uint64_t seed = mix(command.common.seed) >> 1;
  auto a = trace_half(command, mesh, shot, seed);
  if (!a) return a;
  const auto b = trace_half(command, mesh, shot, seed + 1);
  if (!b) return tl::unexpected(b.error());
  const auto between = picture_error(*a, *b);
  if (!between) return tl::unexpected(between.error());
  for (std::size_t i = 0; i < a->pixels.size(); ++i) a->pixels[i] = (a->pixels[i] + b->pixels[i]) * 0.5F;
  // Two pictures of variance s^2 differ by 2 s^2; their mean has s^2 / 2.
  noise = {{"noisePsnr", psnr_of(between->mean_square / 4)}};
  if (auto ok = write_exr(path, to_linear_image(*a)); !ok) return tl::unexpected(ok.error());
  if (auto ok = write_png(fmt::format("{}/truth/{}.png", folder.path, name_of(view)),
                          to_display_image(*a, default_display()));
      !ok)
    return tl::unexpected(ok.error());
  if (auto ok = write_file(record, noise.dump(2) + "\n"); !ok) return tl::unexpected(ok.error());
  return a;
}

/// The held-out pairs of a samples file, if it has those that are wanted and is whole.
std::optional<PairSamples> pairs_there(const std::string& path, int texels, int count) {
  std::error_code none;
  if (!std::filesystem::exists(path, none)) return std::nullopt;
  auto reader = SamplesReader::open(path);
  if (!reader || reader->header().width != texels || reader->header().height != texels) return std::nullopt;
  auto pairs = reader->read_pairs(PairKind::held_out);
  if (!pairs || static_cast<int>(pairs->pairs.size()) != count) return std::nullopt;
  return std::move(*pairs);
}

/// Pairs of the finest size under light that bounces without end, from another seed than the points'.
Result<PairSamples> held_out_pairs(const TradeCommand& command, const CellMesh& mesh,
                                   const TradeFolder& folder, int texels) {
  const std::string path = folder.path + "/truth/held-out.samples.exr";
  if (auto there = pairs_there(path, texels, command.held_out_pairs)) return std::move(*there);
  BakeOptions options;
  options.width = options.height = texels;
  options.views = options.lights = 1;
  options.samples = 1;
  options.bounces = unlimited_bounces;
  options.validation_pairs = options.rim_pairs = 0;
  options.held_out_pairs = command.held_out_pairs;
  options.truth_samples = command.held_out_samples;
  options.seed = mix(command.common.seed) >> 1;
  if (const auto baked = bake(mesh, command.input, options, "{}", path); !baked)
    return tl::unexpected(baked.error());
  auto reader = SamplesReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  return reader->read_pairs(PairKind::held_out);
}

/// Whether the point's fabric and a record of it are there and whole; else it is measured again.
bool is_measured(const TradeFolder& folder, const TradePoint& point) {
  const auto record = read_trade_record(folder.record(point));
  return record && is_point_record(*record, name_of(point)) &&
         number_at(*record, "/bytes") == static_cast<double>(size_of_file(folder.fabric(point))) &&
         read_fabric(folder.fabric(point));
}

/// Why an earlier run found that the point cannot be made; nothing where none has.
std::optional<std::string> why_left_out(const TradeFolder& folder, const TradePoint& point) {
  const auto json = read_json(folder.record(point));
  if (!json.is_object() || json.value("name", nlohmann::json()) != name_of(point)) return std::nullopt;
  const auto why = json.value("leftOut", nlohmann::json());
  if (!why.is_string()) return std::nullopt;
  return why.get<std::string>();
}

/// Whether no fabric of the point is as small as its budget, or none can be chosen at all.
bool is_refused_budget(const TradePoint& point, const Error& error) {
  return point.budget > 0 && error.code == Code::option_out_of_range &&
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
    leave_out_known();
    if (auto ok = find_truth(cell->mesh, texels); !ok) return ok;
    if (auto ok = measure(); !ok) return ok;
    if (points_.empty())
      return fail(Code::option_out_of_range, command_.input, "--grid", "has no point that can be made");
    return write_trade_page(folder_.path);
  }

  std::size_t points() const { return points_.size(); }
  int measured() const { return measured_; }

 private:
  /// What the stitch refuses to be baked with.
  Result<void> leave_out_too_coarse(const Cell& cell) {
    if (!cell.stitch) return {};
    const int least = std::max(cell.stitch->min_texels.x, cell.stitch->min_texels.y);
    const auto too_coarse = [&](const TradePoint& p) { return p.texels < least; };
    const auto end = std::remove_if(points_.begin(), points_.end(), too_coarse);
    if (end == points_.end()) return {};
    points_.erase(end, points_.end());
    if (points_.empty()) {
      return fail(Code::option_out_of_range, command_.input, "--grid",
                  fmt::format("has no point of {} texels or more, which this stitch needs", least));
    }
    if (!command_.common.quiet)
      report_remark(command_.input, fmt::format("points of fewer than {} texels are left out", least));
    return {};
  }

  /// Points that an earlier run could not make; no bake is needed to know it again.
  void leave_out_known() {
    const auto known = [&](const TradePoint& point) {
      const auto why = why_left_out(folder_, point);
      if (why) tell_left_out(point, *why);
      return why.has_value();
    };
    points_.erase(std::remove_if(points_.begin(), points_.end(), known), points_.end());
  }

  /// The point is no longer one of the sweep's; one that cannot be made does not end it.
  Result<void> leave_out(const TradePoint& point, const std::string& why) {
    tell_left_out(point, why);
    points_.erase(std::remove(points_.begin(), points_.end(), point), points_.end());
    if (auto ok = write_sweep(); !ok) return ok;
    const Json record = {{"name", name_of(point)}, {"leftOut", why}};
    return write_file(folder_.record(point), record.dump(2) + "\n");
  }

  void tell_left_out(const TradePoint& point, const std::string& why) const {
    if (!command_.common.quiet)
      report_remark(command_.input, fmt::format("{} is left out: {}", name_of(point), why));
  }

  Result<void> find_truth(const CellMesh& mesh, int texels) {
    truth_.period_mm = mesh.period;
    for (const SwatchView view : all_swatch_views) {
      say(fmt::format("the true picture {}", name_of(view)));
      auto picture = true_picture(command_, mesh, view, folder_, noise_[std::string(name_of(view))]);
      if (!picture) return tl::unexpected(picture.error());
      truth_.pictures.push_back(std::move(*picture));
    }
    say("the held-out pairs");
    auto pairs = held_out_pairs(command_, mesh, folder_, texels);
    if (!pairs) return tl::unexpected(pairs.error());
    truth_.held_out = std::move(*pairs);
    truth_.peak = peak_of(truth_.held_out);
    if (auto ok = write_png(folder_.picture(trade_truth_picture), thumbnail_of(truth_.pictures)); !ok)
      return ok;
    return write_sweep();
  }

  Result<void> write_sweep() const {
    Json names = Json::array();
    for (const TradePoint& point : points_) names.push_back(name_of(point));
    Json presets = Json::object();
    for (const std::string_view name : quality_names)
      presets[std::string(name)] = name_of(point_of(*quality_named(name)));
    const Json sweep = {
        {"trade", 1},        {"identity", identity_}, {"periodMm", {truth_.period_mm.x, truth_.period_mm.y}},
        {"truth", noise_},   {"peak", truth_.peak},   {"points", names},
        {"presets", presets}};
    return write_file(folder_.path + "/" + trade_sweep_file, sweep.dump(2) + "\n");
  }

  /// What is not measured, points of one bake after each other, so that its samples can go.
  std::vector<TradePoint> points_left() const {
    std::vector<TradePoint> unmeasured;
    std::copy_if(points_.begin(), points_.end(), std::back_inserter(unmeasured),
                 [&](const TradePoint& point) { return !is_measured(folder_, point); });
    std::vector<TradePoint> left;
    for (const TradePoint& first : unmeasured) {
      for (const TradePoint& point : unmeasured) {
        if (bake_name_of(point) == bake_name_of(first) &&
            std::find(left.begin(), left.end(), point) == left.end())
          left.push_back(point);
      }
    }
    return left;
  }

  Result<void> measure() {
    const std::vector<TradePoint> left = points_left();
    double total = 0;
    for (const TradePoint& point : left) total += cost_of(point);
    tidy_bakes(left);
    const auto start = Clock::now();
    const Progress bar = progress_.callback();
    double done = 0;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const TradePoint& point = left[i];
      say(name_of(point));
      const auto bake_seconds = ensure_samples(command_, point, folder_);
      if (!bake_seconds) return tl::unexpected(bake_seconds.error());
      const auto record = measure_point(command_, point, folder_, truth_, *bake_seconds);
      if (!record && !is_refused_budget(point, record.error())) return tl::unexpected(record.error());
      std::error_code none;
      const bool last_of_bake = i + 1 == left.size() || bake_name_of(left[i + 1]) != bake_name_of(point);
      if (last_of_bake && !command_.keep_samples) std::filesystem::remove(folder_.samples(point), none);
      done += cost_of(point);
      if (bar) bar(done / total);
      if (!record) {
        if (auto ok = leave_out(point, record.error().message); !ok) return ok;
        continue;
      }
      ++measured_;
      tell(*record, i + 1, left.size(), seconds_since(start) * (total - done) / done);
    }
    return {};
  }

  /// Takes away what a sweep that was killed left in the folder of bakes: files half written, and samples
  /// that no point needs any more.
  void tidy_bakes(const std::vector<TradePoint>& left) const {
    for (const TradePoint& point : points_) {
      const std::string samples = folder_.samples(point);
      const bool needed = command_.keep_samples || std::any_of(left.begin(), left.end(), [&](const auto& p) {
                            return folder_.samples(p) == samples;
                          });
      std::error_code none;
      if (!needed) std::filesystem::remove(samples, none);
      // Who begins a file takes away what others left of it.
      for (const char* ending : {"", ".journal"}) (void)AtomicFile::create(samples + ending);
    }
  }

  void say(const std::string& what) { progress_.note(what); }

  void tell(const Json& record, std::size_t done, std::size_t all, double seconds_left) {
    if (command_.common.quiet || command_.common.json) return;
    fmt::print(stderr, "{}/{} {}: {:.2f} dB, SSIM {:.4f}, {} bytes, {:.2f} s; {:.0f} s left\n", done, all,
               record["name"].get<std::string>(), record["pictures"]["all"]["psnr"].get<double>(),
               record["pictures"]["all"]["ssim"].get<double>(), record["bytes"].get<std::uint64_t>(),
               record["seconds"]["make"].get<double>(), seconds_left);
  }

  const TradeCommand& command_;
  TradeFolder folder_;
  TerminalProgress progress_;
  std::vector<TradePoint> points_;
  Json identity_;
  Json noise_ = Json::object();  ///< of the true pictures
  TradeTruth truth_;
  int measured_ = 0;
};

}  // namespace

Result<int> run(const TradeCommand& command) {
  const auto start = Clock::now();
  Sweep sweep(command);
  if (auto ok = sweep.run(); !ok) return tl::unexpected(ok.error());
  const double seconds = seconds_since(start);
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
