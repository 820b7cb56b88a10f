// compare: the errors of fabrics on samples that no fit has used.
#include "format/quality/compare.h"

#include <fmt/format.h>

#include <array>
#include <optional>

#include "apps/common/paths.h"
#include "apps/report/compare_plot.h"
#include "apps/selvedge/ask_model.h"
#include "apps/selvedge/commands.h"
#include "fitter/training_pairs.h"
#include "format/base/atomic_file.h"
#include "format/fabric/file.h"

namespace selvedge {
namespace {

struct CompareCommand {
  CommonOptions common;
  std::vector<std::string> files;  ///< fabrics, then the samples
  std::string model;               ///< a command that answers queries; empty: none
  std::string plot;                ///< .svg of the one fabric; empty: none
};

void declare(Options& options, CompareCommand& command) {
  options.common(command.common);
  options.list("files", command.files, "[FABRIC...] SAMPLES", "Fabric files, then the samples file")
      .required()
      .count(1, 1000)
      .reads();
  options.text("--model", command.model, "COMMAND",
               "Judge a program that answers queries as 'selvedge answer' does, on the same pairs");
  options
      .text("--plot", command.plot, "FILE",
            "Draw truth, fit and difference, and the error over angles and levels (.svg)")
      .ends_in({".svg"})
      .writes();
  options.check([&command] {
    if (command.files.size() == 1 && command.model.empty())
      refuse("files", "there is neither a fabric nor a --model");
    if (!command.plot.empty() && command.files.size() != 2) refuse("--plot", "draws one fabric");
  });
}

using Rows = std::vector<LevelComparison>;

Json rows_json(const Rows& rows) {
  Json json = Json::array();
  for (const LevelComparison& l : rows) {
    json.push_back({{"level", l.level},
                    {"texels", {l.width, l.height}},
                    {"psnr", l.psnr},
                    {"relativeL2", l.relative_l2},
                    {"meanError", l.mean_error},
                    {"alphaRms", l.alpha_rms},
                    {"alphaNoise", l.alpha_noise},
                    {"truthNoisePsnr", l.noise_psnr}});
  }
  return json;
}

std::string rows_text(const Rows& rows) {
  std::string text;
  for (const LevelComparison& l : rows) {
    text += fmt::format("    {:5}  {:>7}  {:7.2f}  {:11.4f}  {:+9.2f} %  {:9.4f}  {:16.1f}\n", l.level,
                        fmt::format("{}x{}", l.width, l.height), l.psnr, l.relative_l2, 100 * l.mean_error,
                        l.alpha_rms, l.noise_psnr);
  }
  return text;
}

/// Those that no lobes were fitted to.
constexpr std::array judged_kinds{PairKind::held_out, PairKind::rim, PairKind::validation};

/// The reports of one fabric, or of a model.
struct Judged {
  Json json;
  std::string text;

  void add(PairKind kind, const Comparison& comparison, const Comparison* yarn) {
    Json& of_kind = json[name_of(kind)];
    of_kind = {
        {"pairs", comparison.pairs}, {"peak", comparison.peak}, {"levels", rows_json(comparison.levels)}};
    text +=
        fmt::format("  {}: {} pairs, peak {:.4g} 1/sr\n", name_of(kind), comparison.pairs, comparison.peak);
    text += "    level   texels  PSNR dB  relative L2  mean error  alpha rms  truth's noise dB\n";
    if (yarn != nullptr) {
      of_kind["yarn"] = rows_json(yarn->levels);
      text += rows_text(yarn->levels);
    }
    text += rows_text(comparison.levels);
  }
};

/// `compared(kind, pairs, peak)` has what add() takes, and gives back the peak.
template <class Compared>
void for_each_kind(const ByPairKind<PairSamples>& truth, const Compared& compared) {
  double peak = 0;
  for (const PairKind kind : judged_kinds) {
    const PairSamples& pairs = truth[static_cast<std::size_t>(kind)];
    if (!pairs.pairs.empty()) peak = compared(kind, pairs, peak);
  }
}

Result<int> run(const CompareCommand& command) {
  must(check_writable({command.plot}));
  const std::string& samples = command.files.back();
  auto reader = must(SamplesReader::open(samples));
  ByPairKind<PairSamples> truth;
  for (const PairKind kind : judged_kinds) {
    truth[static_cast<std::size_t>(kind)] = must(reader.read_pairs(kind));
  }
  Json report_json = {{"samples", samples}, {"fabrics", Json::array()}};
  std::string text;
  std::optional<Fabric> fabric;
  int asked_levels = level_count(reader.header().width, reader.header().height);
  for (std::size_t i = 0; i + 1 < command.files.size(); ++i) {
    const std::string& path = command.files[i];
    fabric = must(read_fabric(path));
    if (i == 0) asked_levels = static_cast<int>(fabric->levels.size());
    const auto bytes = size_of_file(path);
    Judged judged{{{"fabric", path}, {"bytes", bytes}}, fmt::format("{} ({} bytes)\n", path, bytes)};
    for_each_kind(truth, [&](PairKind kind, const PairSamples& pairs, double peak) {
      auto comparison = compare(*fabric, pairs, kind, peak);
      if (!comparison) comparison.error().file = path;
      const Comparison levels = must(std::move(comparison));
      std::optional<Comparison> yarn;
      if (fabric->levels.front().yarns()) yarn = compare_yarn(*fabric, pairs, kind, levels.peak);
      judged.add(kind, levels, yarn ? &*yarn : nullptr);
      return levels.peak;
    });
    report_json["fabrics"].push_back(judged.json);
    text += judged.text;
  }
  ByPairKind<PairAnswers> answers;
  if (!command.model.empty()) {
    answers = must(ask_model(command.model, command.files.front(), asked_levels, truth));
    Judged judged{{{"command", command.model}}, command.model + "\n"};
    for_each_kind(truth, [&](PairKind kind, const PairSamples& pairs, double peak) {
      const auto comparison = compare_answers(answers[static_cast<std::size_t>(kind)], pairs, kind, peak);
      judged.add(kind, comparison, nullptr);
      return comparison.peak;
    });
    report_json["model"] = judged.json;
    text += judged.text;
  }
  if (!command.plot.empty()) {
    const auto held_out = static_cast<std::size_t>(PairKind::held_out);
    const auto training = must(read_training_pairs(reader));
    must(write_file(command.plot, must(compare_plot(*fabric, truth[held_out], training,
                                                    {command.files.front(), samples,
                                                     size_of_file(command.files.front()), command.model},
                                                    answers[held_out]))));
  }
  report(command.common, "compare", report_json, text);
  return 0;
}

}  // namespace

void add_compare_verb(Program& program) {
  program.add<CompareCommand>(
      {"compare", "Error of fabrics against held-out samples, per level",
       "selvedge compare k.fabric.exr k.samples.exr\n"
       "selvedge compare k.fabric.exr k.samples.exr --model 'selvedge answer' --plot k.svg"},
      declare, run);
}

}  // namespace selvedge
