// trade: adds the viewer's own settings, and times per frame, to a sweep that `selvedge trade` has made.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>

#include "apps/report/machine.h"
#include "apps/report/median.h"
#include "apps/report/trade_page.h"
#include "apps/report/trade_records.h"
#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/trade_settings.h"
#include "format/base/atomic_file.h"
#include "format/base/printable.h"
#include "format/base/progress.h"
#include "format/fabric/file.h"
#include "format/quality/picture_error.h"
#include "format/scene/swatch.h"
#include "viewer/renderer.h"

namespace selvedge {
namespace {

struct TradeCommand {
  CommonOptions common;
  std::string folder;  ///< of a sweep by `selvedge trade`
  int repeats = 5;     ///< times are medians of so many
  V2i size{640, 480};  ///< of the frames that are timed
};

void declare(Options& options, TradeCommand& command) {
  options.common(command.common);
  options.text("folder", command.folder, "DIR", "The folder of selvedge trade").required();
  options.number("--repeats", command.repeats, "N", "Times are medians of so many frames").in(1, 999);
  options.size("--size", command.size, "Of the frames that are timed", 1, 8192);
  options.check([&command] {
    if (command.size.x > 4 * command.size.y) refuse("--size", "must be at most four times as wide as high");
  });
}

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

double processor_ms_now() { return 1000 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

Result<std::vector<Frame>> read_truth(const std::string& folder) {
  std::vector<Frame> frames;
  for (const std::string_view view : swatch_view_names) {
    const std::string path = fmt::format("{}/truth/{}.exr", folder, view);
    const auto image = read_image(path, Transfer::keep);
    if (!image) return tl::unexpected(image.error());
    frames.push_back(to_frame(*image));
  }
  return frames;
}

/// What figures belong to beside the fabric: others are measured anew.
Json made_by(const TradeCommand& command) {
  return {{"software", "selvedge " SELVEDGE_VERSION},
          {"machine", machine_json()},
          {"repeats", command.repeats},
          {"frameSize", {command.size.x, command.size.y}}};
}

/// The shots that this program draws for a sweep's pictures, as its record would have them; nothing where the
/// record does not say which.
Json places_here(const Json& sweep) {
  const double x = number_at(sweep, "/periodMm/0");
  const double y = number_at(sweep, "/periodMm/1");
  const double width = number_at(sweep, "/identity/size/0");
  const double height = number_at(sweep, "/identity/size/1");
  const auto is_size = [](double n) { return n >= 1 && n <= 1 << 20; };
  if (!(x > 0 && y > 0) || !is_size(width) || !is_size(height)) return {};
  return digest_of_shots({x, y}, static_cast<int>(width), static_cast<int>(height));
}

/// The points of a sweep that this program on this machine may add to.
Result<std::vector<std::string>> read_points(const std::string& folder, const Json& made_by) {
  const std::string path = folder + "/" + trade_sweep_file;
  const auto sweep = read_sweep_record(folder);
  if (!sweep) return tl::unexpected(sweep.error());
  const Json there = object_at(*sweep, "identity");
  Json here = made_by;
  here["places"] = places_here(*sweep);
  for (const char* member : {"/software", "/machine/processor", "/machine/cores", "/places"}) {
    const Json::json_pointer at(member);
    if (!there.contains(at))
      return fail(Code::file_damaged, path, std::string("/identity") + member, "is not there");
    if (there[at] != here[at])
      return fail(
          Code::option_out_of_range, path, std::string("/identity") + member,
          fmt::format("is {}, and here it is {}: a sweep keeps to one program, machine and set of places",
                      there[at].dump(-1, ' ', false, Json::error_handler_t::replace),
                      here[at].dump(-1, ' ', false, Json::error_handler_t::replace)));
  }
  auto points = trade_names(*sweep, path, "points");
  if (points && points->empty()) return fail(Code::file_damaged, path, "points", "has no point");
  return points;
}

/// A fabric read and made ready, and how long that takes.
struct Loaded {
  Fabric fabric;
  std::string digest;
  double milliseconds = 0;
};

Result<Loaded> load(const std::string& path, int repeats) {
  Loaded loaded;
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const auto start = Clock::now();
    auto reader = FabricReader::open(path);
    if (!reader) return tl::unexpected(reader.error());
    auto fabric = reader->read();
    if (!fabric) return tl::unexpected(fabric.error());
    times.push_back(ms_since(start));
    loaded.fabric = std::move(*fabric);
    loaded.digest = reader->digest();
  }
  loaded.milliseconds = median(times);
  return loaded;
}

class FrameSweep {
 public:
  explicit FrameSweep(const TradeCommand& command)
      : command_(command), progress_("trade", command.common.quiet), bar_(progress_.callback()) {}

  Result<void> run() {
    made_by_ = made_by(command_);
    const auto points = read_points(command_.folder, made_by_);
    if (!points) return tl::unexpected(points.error());
    // What the page refuses is told before hours of frames.
    if (const auto table = read_trade_table(command_.folder); !table) return tl::unexpected(table.error());
    auto truth = read_truth(command_.folder);
    if (!truth) return tl::unexpected(truth.error());
    truth_ = std::move(*truth);
    if (std::none_of(points->begin(), points->end(), [&](const auto& point) { return is_made(point); }))
      return fail(Code::file_missing, command_.folder, trade_sweep_file,
                  "none of its points has been made: `selvedge trade` does that");
    const std::string frames = fmt::format("{}/{}", command_.folder, trade_frames_folder);
    std::error_code error;
    std::filesystem::create_directories(frames, error);
    if (error) return fail(Code::file_unwritable, frames, "", error.message());
    if (auto ok = write_list(*points); !ok) return ok;
    const auto left = work_left(*points);
    if (!left) return tl::unexpected(left.error());
    for (const Work& work : *left) settings_ += work.settings.size();
    for (const Work& work : *left) {
      if (auto ok = measure_fabric(work); !ok) return ok;
    }
    return write_trade_page(command_.folder);
  }

  int measured() const { return measured_; }

 private:
  std::string fabric_path(const std::string& point) const {
    return fmt::format("{}/fabrics/{}.fabric.exr", command_.folder, point);
  }

  std::string record_path(const std::string& name) const {
    return fmt::format("{}/{}/{}.json", command_.folder, trade_frames_folder, name);
  }

  /// A sweep that was interrupted has not made all of them.
  bool is_made(const std::string& point) const {
    const std::string record = fmt::format("{}/{}/{}.json", command_.folder, trade_points_folder, point);
    std::error_code none;
    return std::filesystem::exists(fabric_path(point), none) && std::filesystem::exists(record, none);
  }

  /// What is to be on the page: records of an earlier centre, size or machine may lie in the folder.
  Result<void> write_list(const std::vector<std::string>& points) const {
    Json names = Json::array();
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (const TradeSetting& setting : settings_of(i == 0)) names.push_back(name_of(points[i], setting));
    }
    Json presets = Json::object();
    for (std::size_t i = 0; i < frame_quality_names.size(); ++i)
      presets[std::string(frame_quality_names[i])] = name_of(points.front(), quality_setting(i));
    const Json list = {{"madeBy", made_by_}, {"presets", presets}, {"frames", names}};
    return write_file(fmt::format("{}/{}", command_.folder, trade_frames_file), list.dump(2) + "\n");
  }

  static std::string name_of(const std::string& point, const TradeSetting& setting) {
    return point + "--" + setting.name;
  }

  static std::vector<TradeSetting> settings_of(bool all) {
    return all ? trade_settings() : std::vector{usual_setting()};
  }

  /// Settings of a fabric that are to be measured.
  struct Work {
    std::string point;
    bool swept = false;
    std::vector<TradeSetting> settings;
  };

  /// The sweep's first point, which is its centre, with all settings, the others with the usual one; but for
  /// those that have a record of this fabric on these terms.
  Result<std::vector<Work>> work_left(const std::vector<std::string>& points) const {
    std::vector<Work> left;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!is_made(points[i])) continue;
      const auto reader = FabricReader::open(fabric_path(points[i]));
      if (!reader) return tl::unexpected(reader.error());
      Work work{points[i], i == 0, {}};
      for (const TradeSetting& setting : settings_of(work.swept)) {
        if (!is_measured(work, setting, reader->digest())) work.settings.push_back(setting);
      }
      if (!work.settings.empty()) left.push_back(std::move(work));
    }
    return left;
  }

  /// What figures of that fabric have to agree with.
  Json made_of(const std::string& digest) const {
    Json made_by = made_by_;
    made_by["fabric"] = digest;
    return made_by;
  }

  bool is_measured(const Work& work, const TradeSetting& setting, const std::string& digest) const {
    const std::string name = name_of(work.point, setting);
    const auto there = read_trade_record(record_path(name));
    return there && is_frame_record(*there, name) && (*there)["madeBy"] == made_of(digest) &&
           (*there)["swept"] == work.swept;
  }

  Result<void> measure_fabric(const Work& work) {
    const auto loaded = load(fabric_path(work.point), command_.repeats);
    if (!loaded) return tl::unexpected(loaded.error());
    for (const TradeSetting& setting : work.settings) {
      progress_.note(name_of(work.point, setting));
      if (auto ok = measure(work.point, *loaded, setting, work.swept); !ok) return ok;
      if (bar_) bar_(static_cast<double>(++done_) / static_cast<double>(settings_));
    }
    return {};
  }

  Result<void> measure(const std::string& point, const Loaded& loaded, const TradeSetting& setting,
                       bool swept) {
    const std::string name = name_of(point, setting);
    std::vector<Frame> frames;
    Timing sum;
    for (std::size_t i = 0; i < all_swatch_views.size(); ++i) {
      const SwatchView view = all_swatch_views[i];
      auto frame = draw(loaded.fabric, setting, view, {truth_[i].width, truth_[i].height}, nullptr);
      if (!frame && setting.render.path == RenderPath::paper &&
          frame.error().code == Code::option_out_of_range)
        return leave_out(name, frame.error());
      if (!frame) return tl::unexpected(frame.error());
      frames.push_back(std::move(*frame));
      if (const auto large = draw(loaded.fabric, setting, view, command_.size, &sum); !large)
        return tl::unexpected(large.error());
    }
    const auto pictures = picture_errors_json(frames, truth_);
    if (!pictures) return tl::unexpected(pictures.error());
    const std::string picture = fmt::format("{}/{}/{}.png", command_.folder, trade_pictures_folder, name);
    if (auto ok = write_png(picture, thumbnail_of(frames)); !ok) return ok;
    const auto places = static_cast<double>(all_swatch_views.size());
    const Json record = {
        {"name", name},
        {"fabric", point},
        {"usual", setting.name == usual_setting().name},
        {"swept", swept},
        {"knobs", Json::parse(setting.knobs)},
        {"command", fmt::format("selvedge-view render {}.fabric.exr --place near --size {}x{} {} -o near.png",
                                point, truth_[0].width, truth_[0].height, setting.options)},
        {"madeBy", made_of(loaded.digest)},
        {"loadMs", loaded.milliseconds + sum.prepare / places},
        {"frameMs", sum.frame / places},
        {"frameProcessorMs", sum.processor / places},
        {"pictures", *pictures}};
    if (auto ok = write_file(record_path(name), record.dump(2) + "\n"); !ok) return ok;
    ++measured_;
    if (!command_.common.quiet && !command_.common.json)
      fmt::print(stderr, "{}: {:.2f} dB, SSIM {:.4f}, {:.2f} ms a frame\n", name,
                 number_at(record, "/pictures/all/psnr"), number_at(record, "/pictures/all/ssim"),
                 sum.frame / places);
    return {};
  }

  /// A fabric or a setting that the paper's path refuses.
  Result<void> leave_out(const std::string& name, const Error& why) const {
    std::error_code none;
    std::filesystem::remove(record_path(name), none);
    if (!command_.common.quiet && !command_.common.json)
      fmt::print(stderr, "{} is left out: {}\n", name, printable(why.message));
    return {};
  }

  /// ms, summed over the places.
  struct Timing {
    double prepare = 0;
    double frame = 0;
    double processor = 0;  ///< of all cores
  };

  /// Draws once; to add to a timing, `repeats` times more for the medians.
  Result<Frame> draw(const Fabric& fabric, const TradeSetting& setting, SwatchView view, const V2i& size,
                     Timing* timing) const {
    const V2d period(fabric.period_mm);
    const SwatchShot shot = swatch_shot(view, period, size.x, size.y);
    RenderOptions options = setting.render;
    options.width = size.x;
    options.height = size.y;
    options.lights = shot.lights;
    const std::vector<Fabric> fabrics{fabric};
    const auto start = Clock::now();
    auto renderer = Renderer::create(swatch_scene(period, shot), fabrics, options);
    if (!renderer) return tl::unexpected(renderer.error());
    if (timing != nullptr) timing->prepare += ms_since(start);
    Frame frame;
    RenderStats stats;
    if (auto ok = (*renderer)->draw(shot.camera, options, frame, stats); !ok)
      return tl::unexpected(ok.error());
    if (timing == nullptr) return frame;
    std::vector<double> times;
    std::vector<double> processor;
    for (int i = 0; i < command_.repeats; ++i) {
      const auto before = Clock::now();
      const double work_before = processor_ms_now();
      if (auto ok = (*renderer)->draw(shot.camera, options, frame, stats); !ok)
        return tl::unexpected(ok.error());
      times.push_back(ms_since(before));
      processor.push_back(processor_ms_now() - work_before);
    }
    timing->frame += median(times);
    timing->processor += median(processor);
    return frame;
  }

  const TradeCommand& command_;
  std::vector<Frame> truth_;
  Json made_by_;
  TerminalProgress progress_;
  Progress bar_;
  std::size_t settings_ = 0;  ///< to be measured
  std::size_t done_ = 0;
  int measured_ = 0;
};

Result<int> run(const TradeCommand& command) {
  limit_mesa_threads(command.common.threads);
  const auto start = Clock::now();
  FrameSweep sweep(command);
  if (auto ok = sweep.run(); !ok) return tl::unexpected(ok.error());
  const double seconds = ms_since(start) / 1000;
  report(command.common, "trade",
         {{"folder", command.folder}, {"measured", sweep.measured()}, {"seconds", seconds}},
         fmt::format("{} settings measured in {:.1f} s -> {}/index.html\n", sweep.measured(), seconds,
                     command.folder));
  return 0;
}

}  // namespace

void add_trade_verb(Program& program) {
  program.add<TradeCommand>(
      {"trade", "Add the viewer's settings and times to a sweep over speed and accuracy",
       "selvedge trade plain-knit -o trade-knit && selvedge-view trade trade-knit"},
      declare, run);
}

}  // namespace selvedge
