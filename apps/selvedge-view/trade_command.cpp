// trade: adds the viewer's own settings, and times per frame, to a sweep that `selvedge trade` has made.
#include <fmt/format.h>

#include <algorithm>

#include "apps/report/measure.h"
#include "apps/report/trade.h"
#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/trade_settings.h"
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

/// The shots that this program draws for a sweep's pictures, as its record would have them; nothing where the
/// record does not say which.
Json places_here(const Json& trade) {
  const V2d period(number_at(trade, "/periodMm/0"), number_at(trade, "/periodMm/1"));
  const V2d size(number_at(trade, "/identity/size/0"), number_at(trade, "/identity/size/1"));
  const auto is_size = [](double n) { return n >= 1 && n <= 1 << 20; };
  if (!(period.x > 0 && period.y > 0) || !is_size(size.x) || !is_size(size.y)) return {};
  return digest_of_shots(period, static_cast<int>(size.x), static_cast<int>(size.y));
}

class FrameSweep {
 public:
  explicit FrameSweep(const TradeCommand& command)
      : command_(command), folder_{command.folder}, progress_("trade", command.common.quiet) {}

  Result<void> run() {
    trade_ = must(read_trade(folder_));
    // What the page refuses is told before hours of frames.
    must(check_trade(folder_, trade_));
    must(check_origin());
    for (const std::string_view view : swatch_view_names)
      truth_.push_back(to_frame(must(read_image(folder_.truth(view) + ".exr", Transfer::keep))));
    must(list_work());
    const Progress bar = progress_.callback();
    for (std::size_t i = 0; i < work_.size(); ++i) {
      progress_.note(work_[i].name());
      measure(work_[i]);
      if (bar) bar(static_cast<double>(i + 1) / static_cast<double>(work_.size()));
    }
    return write_trade_page(folder_, trade_);
  }

  int measured() const { return measured_; }

 private:
  /// A sweep keeps to one program, machine and set of places. Sets what frames are measured by.
  Result<void> check_origin() {
    made_by_ = {{"software", "selvedge " SELVEDGE_VERSION},
                {"machine", machine_json()},
                {"repeats", command_.repeats},
                {"frameSize", {command_.size.x, command_.size.y}}};
    Json here = made_by_;
    here["places"] = places_here(trade_);
    const Json there = object_at(trade_, "identity");
    for (const char* member : {"/software", "/machine/processor", "/machine/cores", "/places"}) {
      const Json::json_pointer at(member);
      const std::string place = std::string("/identity") + member;
      if (!there.contains(at)) return fail(Code::file_damaged, folder_.record(), place, "is not there");
      const auto text = [&](const Json& json) {
        return json[at].dump(-1, ' ', false, Json::error_handler_t::replace);
      };
      if (there[at] != here[at])
        return fail(
            Code::option_out_of_range, folder_.record(), place,
            fmt::format("is {}, and here it is {}: a sweep keeps to one program, machine and set of places",
                        text(there), text(here)));
    }
    return {};
  }

  /// A setting of a fabric that is to be measured.
  struct Work {
    std::string point;
    TradeSetting setting;
    bool swept = false;
    std::size_t slot = 0;  ///< among the frames of the record
    std::string name() const { return point + "--" + setting.name; }
  };

  /// Lists the frames of the page: the sweep's first point, which is its centre, with all settings, the
  /// others with the usual one. Those that have a record of this fabric on these terms stay where they are.
  Result<void> list_work() {
    const Json known = trade_frames(trade_);
    Json frames = Json::array();
    const Json points = trade_["points"];
    for (const Json& point : points) {
      Work work{text_at(point, "name"), {}, &point == &points.front(), 0};
      const auto reader = FabricReader::open(folder_.fabric(work.point));
      if (!reader && reader.error().code == Code::file_missing) continue;
      if (!reader) return tl::unexpected(reader.error());
      const Json made_by = made_of(reader->digest());
      for (const TradeSetting& setting : work.swept ? trade_settings() : std::vector{usual_setting()}) {
        work.setting = setting;
        work.slot = frames.size();
        const auto same = std::find_if(known.begin(), known.end(), [&](const Json& frame) {
          return frame["name"] == work.name() && frame["madeBy"] == made_by && frame["swept"] == work.swept;
        });
        frames.push_back(same == known.end() ? Json() : *same);
        if (same == known.end()) work_.push_back(work);
      }
    }
    if (frames.empty())
      return fail(Code::file_missing, folder_.record(), "points",
                  "none of them has been made: `selvedge trade` does that");
    trade_["frames"] = std::move(frames);
    trade_["usualFrames"] = Json::array();
    trade_["framePresets"] = Json::object();
    for (std::size_t i = 0; i < frame_quality_names.size(); ++i)
      trade_["framePresets"][std::string(frame_quality_names[i])] =
          Work{text_at(points[0], "name"), quality_setting(i), true, 0}.name();
    return {};
  }

  /// What figures of a fabric have to agree with: others are measured anew.
  Json made_of(const std::string& digest) const {
    Json made_by = made_by_;
    made_by["fabric"] = digest;
    return made_by;
  }

  /// Reads the fabric and sets how long that takes.
  void load(const std::string& point) {
    if (point == loaded_) return;
    const Seconds seconds = must(timed(command_.repeats, [&] {
      return clocked([&]() -> Result<void> {
        auto reader = must(FabricReader::open(folder_.fabric(point)));
        digest_ = reader.digest();
        return reader.read().map([&](Fabric&& fabric) { fabrics_ = {std::move(fabric)}; });
      });
    }));
    loaded_ = point;
    load_seconds_ = seconds.wall;
  }

  void measure(const Work& work) {
    load(work.point);
    std::vector<Frame> frames;
    Timing sum;
    for (std::size_t i = 0; i < all_swatch_views.size(); ++i) {
      const SwatchView view = all_swatch_views[i];
      auto frame = draw(work.setting, view, {truth_[i].width, truth_[i].height}, nullptr);
      // A fabric or a setting that the paper's path refuses.
      if (!frame && work.setting.render.path == RenderPath::paper &&
          frame.error().code == Code::option_out_of_range) {
        if (!command_.common.quiet && !command_.common.json)
          fmt::print(stderr, "{} is left out: {}\n", work.name(), printable(frame.error().message));
        return;
      }
      frames.push_back(must(std::move(frame)));
      must(draw(work.setting, view, command_.size, &sum));
    }
    const auto pictures = must(picture_errors_json(frames, truth_));
    must(write_png(folder_.picture(work.name()), thumbnail_of(frames)));
    const auto places = static_cast<double>(all_swatch_views.size());
    Json& record = trade_["frames"][work.slot];
    record = {
        {"name", work.name()},
        {"fabric", work.point},
        {"usual", work.setting.name == usual_setting().name},
        {"swept", work.swept},
        {"knobs", Json::parse(work.setting.knobs)},
        {"command", fmt::format("selvedge-view render {}.fabric.exr --place near --size {}x{} {} -o near.png",
                                work.point, truth_[0].width, truth_[0].height, work.setting.options)},
        {"madeBy", made_of(digest_)},
        {"loadMs", 1000 * (load_seconds_ + sum.prepare / places)},
        {"frameMs", 1000 * sum.frame.wall / places},
        {"frameProcessorMs", 1000 * sum.frame.processor / places},
        {"pictures", pictures}};
    ++measured_;
    if (!command_.common.quiet && !command_.common.json)
      fmt::print(stderr, "{}: {:.2f} dB, SSIM {:.4f}, {:.2f} ms a frame\n", work.name(),
                 number_at(record, trade_psnr), number_at(record, "/pictures/all/ssim"),
                 number_at(record, "/frameMs"));
    must(write_trade(folder_, trade_));
  }

  /// Seconds, summed over the places.
  struct Timing {
    double prepare = 0;
    Seconds frame;
  };

  /// Draws once; to add to a timing, `repeats` times more for the medians.
  Result<Frame> draw(const TradeSetting& setting, SwatchView view, const V2i& size, Timing* timing) const {
    const V2d period(fabrics_[0].period_mm);
    const SwatchShot shot = swatch_shot(view, period, size.x, size.y);
    RenderOptions options = setting.render;
    options.width = size.x;
    options.height = size.y;
    options.lights = shot.lights;
    std::unique_ptr<Renderer> renderer;
    const auto prepared = clocked([&] {
      return Renderer::create(swatch_scene(period, shot), fabrics_, options)
          .map([&](std::unique_ptr<Renderer>&& made) { renderer = std::move(made); });
    });
    if (!prepared) return tl::unexpected(prepared.error());
    Frame frame;
    RenderStats stats;
    const auto draw_once = [&] { return renderer->draw(shot.camera, options, frame, stats); };
    if (auto ok = draw_once(); !ok) return tl::unexpected(ok.error());
    if (timing == nullptr) return frame;
    const auto drawn = timed(command_.repeats, [&] { return clocked(draw_once); });
    if (!drawn) return tl::unexpected(drawn.error());
    timing->prepare += *prepared;
    timing->frame.wall += drawn->wall;
    timing->frame.processor += drawn->processor;
    return frame;
  }

  const TradeCommand& command_;
  TradeFolder folder_;
  TerminalProgress progress_;
  Json trade_;
  Json made_by_;
  std::vector<Frame> truth_;
  std::vector<Work> work_;
  std::string loaded_;           ///< the point of the members below
  std::vector<Fabric> fabrics_;  ///< one
  std::string digest_;
  double load_seconds_ = 0;
  int measured_ = 0;
};

Result<int> run(const TradeCommand& command) {
  limit_mesa_threads(command.common.threads);
  FrameSweep sweep(command);
  const double seconds = must(clocked([&] { return sweep.run(); }));
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
