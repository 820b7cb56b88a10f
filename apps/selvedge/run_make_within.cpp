// make within limits: tries settings beside the output's place and keeps one of them.
#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "apps/common/paths.h"
#include "apps/selvedge/run_fit.h"
#include "converter/presets/make_within.h"
#include "format/base/atomic_file.h"
#include "format/base/option_text.h"
#include "format/base/parallel.h"
#include "format/quality/compare.h"

namespace selvedge {
namespace {

/// What the table's decibels are of (docs/trade.md).
constexpr int judge_texels = 64;
constexpr int judge_pairs = 48;
constexpr int judge_samples = 32;

std::string figures_text(const MakeFigures& f) {
  return fmt::format("{:.0f} bytes, {:.2f} s, {:.2f} dB", f.bytes, f.seconds, f.held_out);
}

Json to_json(const MakeFigures& f) {
  return {{"bytes", std::round(f.bytes)}, {"seconds", f.seconds}, {"heldOut", f.held_out}};
}

class Search {
 public:
  explicit Search(const MakeCommand& command) : command_(command) {}

  Result<Chosen> run() {
    const auto cell = find_cell(command_.bake.input, command_.bake.cell);
    if (!cell) return tl::unexpected(cell.error());
    const int least = cell->stitch ? std::max(cell->stitch->min_texels.x, cell->stitch->min_texels.y) : 1;
    if (least > judge_texels) {
      return fail(Code::option_out_of_range, command_.bake.input, "--texels",
                  fmt::format("its yarns need {}, more than the {} that settings are known for", least,
                              judge_texels));
    }
    return choose_within(expected_points(), command_.limits, least, thread_count(),
                         [&](const TradePoint& point) { return make(point, cell->mesh); });
  }

  /// What was made of a point that was tried.
  const MadeFabric& made(std::size_t index) const { return made_[index]; }
  Result<void> commit(std::size_t index) { return files_[index].commit(); }

 private:
  Result<void> bake_judge(const CellMesh& mesh) {
    const auto file = AtomicFile::create(command_.fit.output);
    if (!file) return tl::unexpected(file.error());
    BakeOptions options;
    options.width = options.height = judge_texels;
    options.views = options.lights = options.samples = 1;
    options.bounces = unlimited_bounces;
    options.validation_pairs = options.rim_pairs = 0;
    options.held_out_pairs = judge_pairs;
    options.truth_samples = judge_samples;
    options.seed = mix(command_.bake.bake.seed) >> 1;
    options.ground = command_.bake.bake.ground;
    options.reference = command_.bake.bake.reference;
    options.resumable = false;
    if (const auto baked = bake(mesh, command_.bake.input, options, "{}", file->temporary()); !baked)
      return tl::unexpected(naming_output(baked.error(), *file, command_.fit.output));
    auto reader = SamplesReader::open(file->temporary());
    if (!reader) return tl::unexpected(reader.error());
    auto pairs = reader->read_pairs(PairKind::held_out);
    if (!pairs) return tl::unexpected(pairs.error());
    judge_ = std::move(*pairs);
    return {};
  }

  Result<double> held_out_of(const std::string& path, const CellMesh& mesh) {
    if (!judge_) {
      if (auto ok = bake_judge(mesh); !ok) return tl::unexpected(ok.error());
    }
    auto reader = FabricReader::open(path);
    if (!reader) return tl::unexpected(reader.error());
    const auto fabric = reader->read();
    if (!fabric) return tl::unexpected(fabric.error());
    const auto comparison = compare_with_finer(*fabric, *judge_, PairKind::held_out);
    if (!comparison) return tl::unexpected(comparison.error());
    return comparison->levels.front().psnr;
  }

  Result<MakeFigures> make(const TradePoint& point, const CellMesh& mesh) {
    auto file = AtomicFile::create(command_.fit.output);
    if (!file) return tl::unexpected(file.error());
    MakeCommand command = command_;
    set_knobs(
        point, [](const char*) { return false; }, command);
    command.fit.output = file->temporary();
    command.fit.smallest_at_least = true;
    auto made = make_fabric(command);
    if (!made) return tl::unexpected(naming_output(made.error(), *file, command_.fit.output));
    const auto held_out = held_out_of(command.fit.output, mesh);
    if (!held_out) return tl::unexpected(held_out.error());
    made->fitted.output = command_.fit.output;
    const MakeFigures figures{static_cast<double>(made->fitted.bytes), made->seconds, *held_out};
    made_.push_back(std::move(*made));
    files_.push_back(std::move(*file));
    return figures;
  }

  const MakeCommand& command_;
  std::optional<PairSamples> judge_;
  std::vector<MadeFabric> made_;
  std::vector<AtomicFile> files_;
};

/// As a command line that makes the setting: the same bytes in the same file, for what was given beside the
/// limits is there, too.
std::string line_of(const MakeCommand& command, const TradePoint& point) {
  return fmt::format("selvedge make {}{}{} -o {}", shell_word(command.bake.input), command.given,
                     options_text(point), shell_word(command.fit.output));
}

}  // namespace

Result<int> run_within_limits(const MakeCommand& command) {
  // Each try is made beside the output: what the user named is compared here.
  const auto distinct = check_distinct({{"the input", command.bake.input},
                                        {"--output", command.fit.output},
                                        {"--report", command.fit.report}});
  if (!distinct) return tl::unexpected(distinct.error());
  Search search(command);
  const auto chosen = search.run();
  if (!chosen) return tl::unexpected(chosen.error());
  if (!chosen->kept) {
    return fail(Code::option_out_of_range, command.bake.input, "limits",
                fmt::format("are met by no setting ({} made); the nearest is {}: {} {}", chosen->tried.size(),
                            line_of(command, chosen->nearest), chosen->nearest_made ? "made" : "expected",
                            figures_text(chosen->nearest_figures)));
  }
  const std::size_t kept = *chosen->kept;
  if (auto ok = search.commit(kept); !ok) return tl::unexpected(ok.error());
  Json json = {{"chosen", line_of(command, chosen->tried[kept].point)},
               {"expected", to_json(chosen->tried[kept].expected)},
               {"made", to_json(chosen->tried[kept].made)},
               {"tried", Json::array()}};
  std::string text;
  for (const MadePoint& made : chosen->tried) {
    // Alone, its line would refuse: within its budget there is nothing.
    const bool refused = made.too_large();
    json["tried"].push_back({{"command", line_of(command, made.point)},
                             {"expected", to_json(made.expected)},
                             {"made", to_json(made.made)},
                             {"tooLarge", refused}});
    text += fmt::format("tried {}: expected {}; {} {}\n", line_of(command, made.point),
                        figures_text(made.expected), refused ? "the smallest found has" : "made",
                        figures_text(made.made));
  }
  const MadeFabric& made = search.made(kept);
  Json fit = fit_json(made.fitted);
  json.update(made.json);
  json["fit"] = fit;
  if (!command.fit.report.empty()) {
    if (auto ok = write_report(command.fit.report, "make", json, made.fitted); !ok)
      return tl::unexpected(ok.error());
  }
  text += fmt::format("chosen: {}\n{}", line_of(command, chosen->tried[kept].point), fit_text(made.fitted));
  report(command.fit.common, "make", json, text);
  return 0;
}

}  // namespace selvedge
