// trade: measures what pictures of a stitch cost and are worth, from four distances, moving and at rest.
#include "apps/selvedge-view/trade.h"

#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <functional>

#include "apps/selvedge-view/commands.h"
#include "apps/selvedge/make.h"
#include "apps/selvedge/option_groups.h"
#include "converter/bake/truth_swatch.h"
#include "format/base/atomic_file.h"
#include "format/base/parallel.h"
#include "format/picture/display.h"
#include "viewer/accuracy.h"

namespace selvedge {
namespace {

constexpr std::array distances{120, 30, 15, 8};  ///< pixels of the longer period
constexpr int part = 10;  ///< the middle of a frame, of which dB are taken: 1/part of its sides
constexpr int truth_samples = 192;

/// Fabrics by their names in the plot, with options of make.
struct Candidate {
  const char* name;
  std::vector<std::string> options;
};
const std::array<Candidate, 4> candidates{{{"yarn", {}},
                                           {"draft", {"--quality", "draft"}},
                                           {"texels", {"--yarns", "off"}},
                                           {"paper", {"--quality", "paper"}}}};
/// Settings of pictures of yarn at rest; of other fabrics the first is drawn.
struct Setting {
  const char* name;
  int supersample;
  PictureGoal goal;
};
const std::array<Setting, 5> settings{{{"2 x 2 rays", 2, {}},
                                       {"1 ray", 1, {}},
                                       {"4 x 4 rays", 4, {}},
                                       {"--accuracy 36", 2, {36.0, {}}},
                                       {"--seconds 1", 2, {{}, 1.0}}}};

struct TradeCommand {
  CommonOptions common;
  std::string input;
  std::vector<std::string> further;
  CellOptions cell;
  std::string output;  ///< a folder
  V2i size{960, 540};
};

void declare(Options& options, TradeCommand& command) {
  add_cell(options, command.input, command.cell);
  options.list("further", command.further, "STITCH", "Further stitches, each a section of the page").reads();
  options.text("-o,--output", command.output, "DIR", "A folder for the page and the fabrics").required();
  options.size("--size", command.size, "Size of a frame in pixels, multiples of 20", 20, 4000);
  options.add_check([&command] {
    if (command.size.x % (2 * part) != 0 || command.size.y % (2 * part) != 0)
      refuse("--size", fmt::format("must be multiples of {}", 2 * part));
    if (command.size.x > 4 * command.size.y) refuse("--size", "must be at most four times as wide as high");
  });
}

/// Seconds of all threads.
double processor_seconds(std::clock_t since) {
  return static_cast<double>(std::clock() - since) / CLOCKS_PER_SEC;
}

Frame middle_of(const Frame& frame, const V2i& size) {
  Frame middle{size.x, size.y, {}};
  const V2i first = (V2i(frame.width, frame.height) - size) / 2;
  for (int y = 0; y < size.y; ++y) {
    const auto row = frame.pixels.begin() + (first.y + y) * frame.width + first.x;
    middle.pixels.insert(middle.pixels.end(), row, row + size.x);
  }
  return middle;
}

/// A distance from the cloth.
class Distance {
 public:
  Distance(const TradeCommand& command, const V2d& period, int pixels)
      : size_(command.size), period_(period), pixels_(pixels) {}

  SwatchShot middle() const {
    SwatchShot shot = at(0);
    shot.width /= part;
    shot.height /= part;
    shot.camera.window_half_size /= part;
    return shot;
  }

  /// Adds rows of a fabric's frames, and their middle: `pixels`, `drawn`, `ms` of the processor, `db`.
  void measure(const Fabric& fabric, const Frame& truth, bool all, Json row, Json& rows,
               std::vector<Frame>& frames) const {
    RenderOptions options;
    options.lights = at(0).lights;
    // The cloth of all frames: they turn about its origin.
    double reach = 0;
    for (const double side : {-1.0, 1.0})
      for (const double end : {-1.0, 1.0})
        reach = std::max(reach, find_swatch_hit(at(0).camera, {side, end})->point_m.length());
    const int repeats = static_cast<int>(1000 * reach / std::min(period_.x, period_.y)) + 2;
    Scene scene = swatch_scene(period_, V2i(-repeats), V2i(repeats));
    scene.fabrics.emplace_back();
    const std::vector<Fabric> fabrics{fabric};
    Frame frame;
    RenderStats stats;
    const auto add = [&](const char* drawn, double seconds) {
      frames.push_back(middle_of(frame, V2i(middle().width, middle().height)));
      row.update({{"pixels", pixels_},
                  {"drawn", drawn},
                  {"ms", 1000 * seconds},
                  {"db", frame_psnr_db(frames.back(), truth)}});
      rows.push_back(row);
    };
    // As `show` draws while the view turns.
    RenderOptions moving = options;
    moving.path = RenderPath::raster;
    moving.width = size_.x;
    moving.height = size_.y;
    moving.cells = moving_cell_images;
    auto renderer = value_or_throw(Renderer::create(scene, fabrics, moving));
    constexpr int count = 12;
    std::vector<double> seconds;
    for (int i = 1 - count; i <= 0; ++i) {
      const std::clock_t before = std::clock();
      value_or_throw(renderer->draw(at(i * (pixels_ > 60 ? 0.5 : 1)).camera, moving, frame, stats));
      seconds.push_back(processor_seconds(before));
    }
    // The first half fills the store of images.
    seconds.erase(seconds.begin(), seconds.begin() + count / 2);
    std::ranges::sort(seconds);
    add("moving", seconds[seconds.size() / 2]);
    // As `render` draws.
    for (const Setting& setting : std::span(settings).first(all ? settings.size() : 1)) {
      FrameSize size = moving;
      size.supersample = setting.supersample;
      // One without images.
      renderer = value_or_throw(Renderer::create(scene, fabrics, moving));
      const std::clock_t before = std::clock();
      value_or_throw(draw_for_goal(*renderer, setting.goal, size, at(0).camera, options, frame, stats));
      add(setting.name, processor_seconds(before));
    }
  }

 private:
  /// A frame of the orbit.
  SwatchShot at(double degrees) const {
    SwatchShot shot = swatch_shot(SwatchView::near, period_, size_.x, size_.y);
    Camera& camera = shot.camera;
    M44d turn;
    turn.setAxisAngle(V3d(0, 0, 1), degrees * radians_per_degree);
    for (V3d* vector : {&camera.position, &camera.right, &camera.up, &camera.to_viewer})
      turn.multDirMatrix(*vector, *vector);
    // Near by, the height shows two repeats.
    const double factor = size_.y / (2.0 * pixels_);
    camera.position *= factor;
    camera.near *= factor;
    camera.far *= factor;
    return shot;
  }

  V2i size_;
  V2d period_;
  int pixels_;
};

TradePicture picture_of(const std::string& words, const Frame& frame) {
  return {words, value_or_throw(encode_png(to_display_image(frame, default_display())))};
}

/// `report` receives notes and fractions of the work.
TradeSection measured(const TradeCommand& command, const std::string& input, const CellMesh& truth,
                      const std::function<void(const std::string&, double)>& tell) {
  std::vector<Fabric> made;
  Json fabrics = Json::array();
  for (const Candidate& candidate : candidates) {
    tell(fmt::format("make {}", candidate.name), 0.1 * static_cast<double>(made.size()));
    const std::string stem = std::filesystem::path(input).stem().string();
    const std::string file = fmt::format("{}/{}-{}.fabric.exr", command.output, stem, candidate.name);
    std::vector<std::string> words{input, "-o", file};
    words.insert(words.end(), candidate.options.begin(), candidate.options.end());
    MakeCommand make = value_or_throw(make_command_of(words, input, "--quality"));
    make.cell = command.cell;
    make.common.quiet = true;
    const std::clock_t before = std::clock();
    made.push_back(make_file(make)->fit.fabric);
    fabrics.push_back({{"stitch", input},
                       {"fabric", candidate.name},
                       {"bytes", file_size_or_zero(file)},
                       {"makeSeconds", processor_seconds(before)}});
  }
  Json rows = Json::array();
  std::vector<TradePicture> pictures;
  for (const int pixels : distances) {
    const Distance distance(command, truth.period, pixels);
    TruthOptions trace;
    trace.samples = truth_samples;
    const Frame traced = value_or_throw(trace_swatch(truth, input, distance.middle(), trace)).frame;
    pictures.push_back(picture_of(fmt::format("{} pixels a repeat: the stitch, traced", pixels), traced));
    std::vector<Frame> frames;
    const std::size_t first = rows.size();
    for (std::size_t i = 0; i < made.size(); ++i) {
      tell(fmt::format("{} pixels a repeat", pixels), 0.4 + 0.006 * static_cast<double>(rows.size()));
      distance.measure(made[i], traced, i == 0, fabrics[i], rows, frames);
    }
    for (std::size_t i = 0; i < frames.size(); ++i)
      pictures.push_back(picture_of(fill_pattern("{fabric}, {drawn}", rows[first + i]), frames[i]));
  }
  return {input, rows, pictures};
}

Result<int> run(const TradeCommand& command) {
  limit_mesa_threads(command.common.threads);
  TerminalProgress progress("trade", command.common.quiet);
  std::vector<std::string> stitches = command.further;
  stitches.insert(stitches.begin(), command.input);
  // A stitch that is refused leaves no folder.
  std::vector<CellMesh> truths;
  for (const std::string& stitch : stitches)
    truths.push_back(value_or_throw(find_cell(stitch, command.cell)).mesh);
  std::error_code error;
  std::filesystem::create_directories(command.output, error);
  if (error) return fail(Code::file_unwritable, command.output, "", error.message());
  std::vector<TradeSection> sections;
  Json rows = Json::array();
  for (const std::string& stitch : stitches) {
    const auto done = static_cast<double>(sections.size());
    const auto tell = [&, show = progress.callback()](const std::string& note, double fraction) {
      progress.print_note(stitch + ": " + note);
      if (show) show((done + fraction) / static_cast<double>(stitches.size()));
    };
    sections.push_back(measured(command, stitch, truths[sections.size()], tell));
    rows.insert(rows.end(), sections.back().rows.begin(), sections.back().rows.end());
  }
  const std::string words = fmt::format(
      "Pictures of {} x {}: milliseconds of processor, and dB against the stitch itself, traced with {} rays "
      "a pixel. Moving as `show` draws while the view turns, at rest as `render` does.",
      command.size.x, command.size.y, truth_samples);
  const std::string page = command.output + "/index.html";
  value_or_throw(write_file(page, trade_page(words, sections)));
  report(command.common, "trade", {{"threads", thread_count()}, {"rows", rows}},
         fmt::format("{}-> {}\n", trade_text(rows), page));
  return 0;
}

}  // namespace

void add_trade_verb(Program& program) {
  program.add<TradeCommand>(
      {"trade", "Measure and plot what pictures of a stitch cost and are worth, from four distances",
       "selvedge-view trade plain-knit twill -o trade"},
      declare, run);
}

}  // namespace selvedge
