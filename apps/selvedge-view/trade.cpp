// trade: sweeps options of make and of render over a stitch, and measures what each setting costs and is
// worth.
#include "apps/selvedge-view/trade.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <map>

#include "apps/common/shared_options.h"
#include "apps/selvedge-view/commands.h"
#include "apps/selvedge-view/shot.h"
#include "apps/selvedge/make.h"
#include "converter/bake/truth_swatch.h"
#include "format/base/atomic_file.h"
#include "format/base/option_text.h"
#include "format/base/random.h"
#include "format/picture/display.h"
#include "format/quality/compare.h"
#include "viewer/renderer.h"

namespace selvedge {
namespace {

/// Clipped sRGB values, not rounded to bytes.
Image display_values(const Frame& frame) {
  Image image = to_display_image(frame, default_display());
  for (float& value : image.pixels) value = linear_to_srgb(value > 0 ? std::min(value, 1.0F) : 0.0F);
  return image;
}

/// dB of display values beside the truth's; at most 200, so that equal pictures have a finite figure.
double picture_psnr(const Frame& frame, const Frame& truth) {
  return std::min(200.0, value_or_throw(compare_images(display_values(frame), display_values(truth))).psnr);
}

/// An option, and the values that a sweep gives it.
struct Swept {
  std::string name;  ///< "--texels"
  std::vector<std::string> values;
  bool of_make = true;  ///< else of render
};

struct TradeCommand {
  CommonOptions common;
  std::string input;   ///< a stitch, or the table of a sweep (.csv)
  std::string output;  ///< a folder
  std::vector<Swept> sweeps;
  SwatchView place = SwatchView::near;
  V2i size{320, 240};
  int truth_samples = 64;
  TradeLimits limits;

  bool is_table() const { return has_ending(input, ".csv"); }
};

/// Whether a verb has the option, by its declarations.
template <class Command>
bool has_option(void (*declare)(Options&, Command&), const std::string& name) {
  Command command;
  bool has = false;
  (void)parse_words(
      [&](Options& options) {
        declare(options, command);
        has = options.declared(name.c_str());
      },
      {}, "", "");
  return has;
}

Swept sweep_from(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos)
    refuse("--sweep", fmt::format("\"{}\" is not of the form texels=4,8,16", text));
  Swept swept{fmt::format("--{}", text.substr(0, equals)), {}, true};
  for (std::size_t at = equals; at != std::string::npos;) {
    const std::size_t end = text.find(',', at + 1);
    swept.values.push_back(text.substr(at + 1, end - at - 1));
    at = end;
  }
  swept.of_make = has_option<MakeCommand>(declare_make, swept.name);
  if (!swept.of_make && !has_option<RenderCommand>(declare_render, swept.name))
    refuse("--sweep", fmt::format("neither make nor render has {}", swept.name));
  return swept;
}

void declare(Options& options, TradeCommand& command) {
  options.common(command.common);
  options
      .text("input", command.input, "STITCH|CSV",
            "A stitch as make takes it, or the table of an earlier sweep")
      .required()
      .reads();
  options.text("-o,--output", command.output, "DIR", "A folder for the table, the page and the fabrics");
  options.list(
      "--sweep", "NAME=VALUES",
      "An option of make or of render, and its values with commas; may be repeated, for all combinations "
      "(default: quality=draft,standard,paper and supersample=1,2)",
      [&command](const std::vector<std::string>& texts) {
        for (const std::string& text : texts) command.sweeps.push_back(sweep_from(text));
      });
  add_place(options, "Camera and lights of the picture [near]",
            [&command](SwatchView place) { command.place = place; });
  options.size("--size", command.size, "Size of the picture in pixels", 16, 2048);
  options
      .number("--truth-samples", command.truth_samples, "N",
              "Rays a pixel of the traced stitch, an even number")
      .in(2, 1 << 20);
  options.bytes("--max-bytes", command.limits.bytes,
                "Choose a setting: at most so many bytes (K, M: KiB, MiB)");
  options
      .number("--min-db", command.limits.picture, "X", "Choose a setting: a picture of at least so many dB")
      .in(0, 200);
  options.number("--max-seconds", command.limits.seconds, "S", "Choose a setting: made in so many seconds")
      .in(0, 1e9);
  options.check([&options, &command] {
    if (command.size.x > 4 * command.size.y) refuse("--size", "must be at most four times as wide as high");
    if (command.truth_samples % 2 != 0) refuse("--truth-samples", "must be even");
    if (command.is_table()) {
      options.refuse_if(true, "has no effect with a table",
                        {"--output", "--sweep", "--place", "--size", "--truth-samples"});
      if (!command.limits.any()) refuse("input", "a table needs --max-bytes, --min-db or --max-seconds");
    } else if (command.output.empty()) {
      refuse("--output", "is required");
    }
    if (command.sweeps.empty())
      command.sweeps = {sweep_from("quality=draft,standard,paper"), sweep_from("supersample=1,2")};
  });
}

/// The words of all combinations of the swept options of make, or of render.
std::vector<std::vector<std::string>> combinations(const std::vector<Swept>& sweeps, bool of_make) {
  constexpr std::size_t most = 1000;
  std::vector<std::vector<std::string>> all(1);
  for (const Swept& swept : sweeps) {
    if (swept.of_make != of_make) continue;
    std::vector<std::vector<std::string>> longer;
    for (const auto& words : all) {
      for (const std::string& value : swept.values) {
        longer.push_back(words);
        longer.back().push_back(fmt::format("{}={}", swept.name, value));
      }
    }
    all = std::move(longer);
    if (all.size() > most)
      throw Failure{
          {Code::option_out_of_range, "", "--sweep", fmt::format("makes more than {} settings", most)}};
  }
  return all;
}

std::string joined(const std::vector<std::string>& words, const char* before) {
  std::string text;
  for (const std::string& word : words) text.append(before).append(shell_word(word));
  return text;
}

struct Seconds {
  double wall = 0;
  double work = 0;  ///< summed over cores
};

template <class Work>
Seconds timed(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t before = std::clock();
  work();
  return {std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(),
          static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC};
}

std::string png_of(const Frame& frame) {
  const auto bytes = value_or_throw(encode_png(to_display_image(frame, default_display())));
  return {bytes.begin(), bytes.end()};
}

/// A make of the sweep.
struct Made {
  std::vector<std::string> words;
  MakeCommand command;
  Fabric fabric;
  Seconds seconds;
};

class Sweep {
 public:
  explicit Sweep(const TradeCommand& command)
      : command_(command), progress_("trade", command.common.quiet), show_(progress_.callback()) {}

  Json run() {
    makes_ = combinations(command_.sweeps, true);
    renders_ = combinations(command_.sweeps, false);
    // Wrong values are told before the work.
    for (const auto& words : makes_) made_.push_back(parsed(words));
    for (const auto& words : renders_) (void)render_of(words, "");
    std::error_code error;
    std::filesystem::create_directories(command_.output, error);
    if (error) throw Failure{{Code::file_unwritable, command_.output, "", error.message()}};
    // A setting without a fabric is told, and has no row.
    failed_ = std::erase_if(made_, [&](Made& made) {
      const Result<void> done = guarded(made.command.output, [&]() -> Result<void> {
        make(made);
        return {};
      });
      if (!done) report_error(done.error());
      return !done;
    });
    Json rows = Json::array();
    for (Made& made : made_) {
      for (const auto& words : renders_) rows.push_back(row_of(made, words));
    }
    value_or_throw(write_file(command_.output + "/trade.csv", csv_of(rows)));
    value_or_throw(
        write_file(command_.output + "/index.html",
                   trade_page(fmt::format("Speed against accuracy: {}", command_.input), rows, pictures_,
                              truths_.size() == 1 ? png_of(truths_.begin()->second.frame) : "")));
    return rows;
  }

  /// Settings without a fabric.
  std::size_t failed() const { return failed_; }

 private:
  Made parsed(const std::vector<std::string>& swept) const {
    std::vector<std::string> words{command_.input, "-o", path_of(swept)};
    words.insert(words.end(), swept.begin(), swept.end());
    Made made{swept, value_or_throw(make_command_of(words, command_.input, "--sweep")), {}, {}};
    made.command.common.quiet = true;
    return made;
  }

  std::string path_of(const std::vector<std::string>& swept) const {
    std::string name = "fabric";
    for (const std::string& word : swept) name.append("-").append(word.substr(2));
    for (char& c : name) {
      if (c == '/') c = '_';
    }
    return fmt::format("{}/{}.fabric.exr", command_.output, name);
  }

  void make(Made& made) {
    note(fmt::format("make{}", joined(made.words, " ")));
    made.seconds = timed([&] { made.fabric = make_file(made.command).fit.fabric; });
  }

  RenderCommand render_of(const std::vector<std::string>& swept, const std::string& fabric) const {
    const std::string file = fabric.empty() ? "any.exr" : fabric;
    std::vector<std::string> words{file,
                                   "-o",
                                   "picture.png",
                                   "--place",
                                   std::string(name_of(command_.place)),
                                   "--size",
                                   fmt::format("{}x{}", command_.size.x, command_.size.y)};
    words.insert(words.end(), swept.begin(), swept.end());
    RenderCommand render;
    value_or_throw(parse_words([&render](Options& options) { declare_render(options, render); }, words, file,
                               "--sweep"));
    return render;
  }

  /// The stitch of a make, traced, and held-out pairs of it.
  struct Truth {
    Frame frame;
    PairSamples held_out;
  };

  /// Makes of the same mesh share their truth. Held-out pairs are as fine as the finest fabric.
  const Truth& truth_of(const Made& made) {
    std::string mesh;
    for (const std::string& word : made.words) {
      for (const char* option : {"--set=", "--grid=", "--period=", "--unit=", "--up=", "--albedo="}) {
        if (word.starts_with(option)) mesh.append(word).append("\n");
      }
    }
    if (const auto known = truths_.find(mesh); known != truths_.end()) return known->second;
    note("the traced stitch");
    const CellMesh cell = value_or_throw(find_cell(command_.input, made.command.cell)).mesh;
    TruthOptions trace;
    trace.samples = command_.truth_samples;
    const SwatchShot shot = swatch_shot(command_.place, cell.period, command_.size.x, command_.size.y);
    Truth truth{value_or_throw(trace_swatch(cell, command_.input, shot, trace)).frame, {}};
    BakeOptions pairs;
    pairs.width = pairs.height = 1;
    for (const Made& other : made_) {
      pairs.width = std::max(pairs.width, other.fabric.texels().x);
      pairs.height = std::max(pairs.height, other.fabric.texels().y);
    }
    pairs.views = pairs.lights = pairs.samples = 1;
    pairs.bounces = unlimited_bounces;
    pairs.validation_pairs = 0;
    pairs.held_out_pairs = 48;
    pairs.truth_samples = 32;
    pairs.seed = mix(made.command.options.bake.seed) >> 1;
    Samples baked = value_or_throw(bake(cell, command_.input, pairs)).samples;
    truth.held_out = std::move(baked.pairs[static_cast<std::size_t>(PairKind::held_out)]);
    return truths_[mesh] = std::move(truth);
  }

  Json row_of(const Made& made, const std::vector<std::string>& words) {
    const Truth& truth = truth_of(made);
    note(fmt::format("render{}", joined(words, " ")));
    const Shot shot = read_shot(render_of(words, made.command.output));
    const Camera& camera = shot.cameras.front();
    RenderOptions options = shot.options;
    options.lights = shot.look.all_lights(camera);
    const auto renderer = value_or_throw(Renderer::create(shot.scene, shot.fabrics, shot.options));
    Frame frame;
    RenderStats stats;
    // The median of three, after one that warms up.
    std::vector<double> work;
    for (int i = 0; i < 4; ++i)
      work.push_back(timed([&] { value_or_throw(renderer->draw(camera, options, frame, stats)); }).work);
    std::sort(work.begin() + 1, work.end());
    pictures_.push_back(png_of(frame));
    // Texels that are no part of the truth's by a power of two have no figure.
    const auto held_out = compare_with_finer(made.fabric, truth.held_out, PairKind::held_out);
    std::string setting;
    for (const auto* list : {&made.words, &words}) {
      for (const std::string& word : *list) setting.append(setting.empty() ? "" : " ").append(word.substr(2));
    }
    Json row = {{"setting", setting},
                {figures::bytes, size_of_file(made.command.output)},
                {figures::seconds, made.seconds.wall},
                {figures::work, made.seconds.work},
                {figures::held_out, held_out ? Json(held_out->levels.front().psnr) : Json()},
                {figures::frame, 1000 * work[2]},
                {figures::picture, picture_psnr(frame, truth.frame)},
                {"make", fmt::format("selvedge make {}{} -o {}", shell_word(command_.input),
                                     joined(made.words, " "), shell_word(made.command.output))},
                {"render", fmt::format("selvedge-view render {} --place {} --size {}x{}{} -o picture.png",
                                       shell_word(made.command.output), name_of(command_.place),
                                       command_.size.x, command_.size.y, joined(words, " "))}};
    return row;
  }

  void note(const std::string& text) {
    progress_.note(text);
    const std::size_t steps = makes_.size() * (1 + renders_.size());
    if (show_) show_(static_cast<double>(pictures_.size()) / static_cast<double>(steps));
  }

  const TradeCommand& command_;
  TerminalProgress progress_;
  Progress show_;
  std::vector<std::vector<std::string>> makes_;
  std::vector<std::vector<std::string>> renders_;
  std::vector<Made> made_;
  std::size_t failed_ = 0;
  std::map<std::string, Truth> truths_;  ///< by the options of the mesh
  std::vector<std::string> pictures_;    ///< PNG files of the rows
};

Result<int> run(const TradeCommand& command) {
  limit_mesa_threads(command.common.threads);
  Sweep sweep(command);
  const Json rows =
      command.is_table()
          ? value_or_throw(
                rows_of(value_or_throw(read_file(command.input, std::uintmax_t{1} << 24)), command.input))
          : sweep.run();
  Json json = {{"input", command.input}, {"rows", rows}};
  std::string text = table_text(rows, {{"setting", "{setting}"},
                                       {"bytes", "{bytes:.0f}"},
                                       {"make, s", "{seconds:.2f}"},
                                       {"frame, ms", "{frameMs:.1f}"},
                                       {"held out, dB", "{heldOutDb:.2f}"},
                                       {"picture, dB", "{pictureDb:.2f}"}});
  if (command.limits.any()) {
    const Json* chosen = chosen_row(rows, command.limits);
    if (chosen == nullptr)
      return fail(Code::option_out_of_range, command.input, "limits",
                  fmt::format("none of {} settings meets them", rows.size()));
    json["chosen"] = *chosen;
    text = filled("{setting}: {bytes:.0f} bytes, {seconds:.2f} s, {pictureDb:.2f} dB\n{make}\n{render}\n",
                  *chosen);
  }
  if (!command.output.empty()) text += fmt::format("-> {}/index.html, trade.csv\n", command.output);
  report(command.common, "trade", json, text);
  return sweep.failed() == 0 ? 0 : 1;
}

}  // namespace

void add_trade_verb(Program& program) {
  program.add<TradeCommand>(
      {"trade", "Measure what settings of make and render cost and are worth, and choose one within limits",
       "selvedge-view trade plain-knit --sweep texels=4,8,16 --sweep supersample=1,2 -o trade\n"
       "selvedge-view trade trade/trade.csv --max-bytes 40K"},
      declare, run);
}

}  // namespace selvedge
