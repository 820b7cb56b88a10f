// fit, and make, which is bake and fit with the mesh before.
#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "converter/tool/commands.h"
#include "converter/tool/run_bake.h"
#include "fitter/layer_fit.h"
#include "format/atomic_file.h"

namespace selvedge {
namespace {

/// What a fit reports, whichever way its layers came about.
struct FitOutcome {
  std::vector<FitLevelReport> levels;  ///< of the paper's model
  std::vector<LevelChoice> chosen;     ///< of a budget
  Issues warnings;
  double seconds = 0;
};

/// Chooses layers and writes the file, which must not be larger than the budget. Sizes are estimated before,
/// so it takes some tries; the largest file that fits is kept.
Result<LayerFit> write_within(const LayerFitter& fitter, const FitCommand& command) {
  constexpr int most_tries = 6;
  const auto budget = static_cast<double>(*command.budget);
  double bytes = budget;
  double best = 0;
  double best_bytes = bytes;
  for (int i = 1;; ++i) {
    LayerFit chosen = fitter.choose(bytes);
    if (auto ok = write_fabric(command.output, chosen.fabric, command.write); !ok) {
      return tl::unexpected(ok.error());
    }
    const auto written = static_cast<double>(size_of_file(command.output));
    const bool fits = written <= budget;
    if (fits && written > best) {
      best = written;
      best_bytes = bytes;
    }
    if (i > most_tries || (fits && written > 0.98 * budget)) return chosen;
    bytes = i == most_tries && best > 0 ? best_bytes : bytes * 0.995 * budget / written;
  }
}

Result<FitOutcome> fit_layers(SamplesReader& reader, SampleLevel level, const FitCommand& command,
                              const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  const auto validation = reader.read_pairs(PairKind::validation);
  if (!validation) return tl::unexpected(validation.error());
  std::optional<HeightLayer> heights;
  if (reader.header().slabs) {
    auto read = reader.read_heights();
    if (!read) return tl::unexpected(read.error());
    heights = std::move(*read);
  }
  const auto fitter =
      LayerFitter::create(std::move(level), reader.header(), heights, *validation, command.fit, progress);
  if (!fitter) return tl::unexpected(fitter.error());
  const auto chosen = write_within(*fitter, command);
  if (!chosen) return tl::unexpected(chosen.error());
  Issues warnings = precision_warnings(command.output, chosen->fabric, command.write);
  for (const Error& warning : warnings) {
    if (!(command.common.quiet || command.common.json)) report_issue(warning);
  }
  return FitOutcome{{},
                    chosen->levels,
                    std::move(warnings),
                    std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
}

Result<FitOutcome> fit_file(const std::string& samples, const FitCommand& command) {
  // Said before the work, not after it.
  if (const auto writable = AtomicFile::create(command.output); !writable) {
    return tl::unexpected(writable.error());
  }
  auto reader = SamplesReader::open(samples);
  if (!reader) return tl::unexpected(reader.error());
  TerminalProgress progress("fit", command.common.quiet);
  const auto of_file = [&](Error error) {
    if (error.file.empty()) error.file = samples;
    return tl::unexpected(std::move(error));
  };
  if (command.budget) {
    auto level = reader->read_level();
    if (!level) return tl::unexpected(level.error());
    auto outcome = fit_layers(*reader, std::move(*level), command, progress.callback());
    if (!outcome) return of_file(outcome.error());
    return outcome;
  }
  auto result = fit(*reader, command.fit, progress.callback());
  if (!result) return of_file(result.error());
  for (Error& warning : result->warnings) {
    warning.file = samples;
    if (!(command.common.quiet || command.common.json)) report_issue(warning);
  }
  if (auto ok = write_fabric(command.output, result->fabric, command.write); !ok) {
    return tl::unexpected(ok.error());
  }
  for (Error& warning : precision_warnings(command.output, result->fabric, command.write)) {
    if (!(command.common.quiet || command.common.json)) report_issue(warning);
    result->warnings.push_back(std::move(warning));
  }
  return FitOutcome{result->levels, {}, result->warnings, result->seconds};
}

Json fit_json(const FitOutcome& outcome, const std::string& output) {
  Json levels = Json::array();
  for (const FitLevelReport& level : outcome.levels) {
    levels.push_back({{"texels", {level.width, level.height}},
                      {"trainingError", level.training_error},
                      {"iterations", level.mean_iterations},
                      {"unconverged", level.unconverged},
                      {"seconds", level.seconds}});
  }
  for (const LevelChoice& level : outcome.chosen) {
    levels.push_back({{"texels", {level.width, level.height}},
                      {"layers", level.layers},
                      {"validationError", std::sqrt(level.validation_error)},
                      {"bytes", std::round(level.bytes)}});
  }
  Json warnings = Json::array();
  for (const Error& warning : outcome.warnings) warnings.push_back(to_json(warning));
  return {{"output", output},
          {"bytes", size_of_file(output)},
          {"seconds", outcome.seconds},
          {"levels", levels},
          {"warnings", warnings}};
}

std::string fit_text(const FitOutcome& outcome, const std::string& output) {
  std::string text;
  if (!outcome.levels.empty()) {
    text = "level  texels   training error  iterations  not converged  seconds\n";
  }
  for (std::size_t k = 0; k < outcome.levels.size(); ++k) {
    const FitLevelReport& l = outcome.levels[k];
    text += fmt::format("{:5}  {:>7}  {:14.4f}  {:10.1f}  {:13}  {:7.2f}\n", k,
                        fmt::format("{}x{}", l.width, l.height), l.training_error, l.mean_iterations,
                        l.unconverged, l.seconds);
  }
  if (!outcome.chosen.empty()) text += "level  texels   validation RMS 1/sr    bytes  layers\n";
  for (std::size_t k = 0; k < outcome.chosen.size(); ++k) {
    const LevelChoice& l = outcome.chosen[k];
    text += fmt::format("{:5}  {:>7}  {:19.5f}  {:7.0f}  {}\n", k, fmt::format("{}x{}", l.width, l.height),
                        std::sqrt(l.validation_error), l.bytes, l.layers);
  }
  return text +
         fmt::format("fitted in {:.1f} s -> {} ({} bytes)\n", outcome.seconds, output, size_of_file(output));
}

}  // namespace

int run(const FitCommand& command) {
  apply(command.common);
  const auto result = fit_file(command.input, command);
  if (!result) return report_error(result.error());
  report(command.common, "fit", fit_json(*result, command.output), fit_text(*result, command.output));
  return 0;
}

int run(const MakeCommand& command) {
  apply(command.fit.common);
  // The samples pass through a file, as they do between the single verbs; without --keep-samples through one
  // beside the fabric that is gone afterwards, whatever happens.
  auto passing = AtomicFile::create(command.fit.output);
  if (!passing) return report_error(passing.error());
  BakeCommand bake_command = command.bake;
  const bool keep = !bake_command.output.empty();
  if (!keep) {
    bake_command.output = passing->temporary();
    bake_command.bake.resumable = false;
  }
  const auto baked = bake_cell(bake_command, command.fit.common);
  if (!baked) return report_error(baked.error());
  Json bake_report = bake_json(*baked, bake_command.output);
  if (!keep) bake_report.erase("output");
  const std::string bake_line = bake_text(*baked, keep ? bake_command.output : "");
  const auto fitted = fit_file(bake_command.output, command.fit);
  if (!fitted) return report_error(fitted.error());
  report(command.fit.common, "make", {{"bake", bake_report}, {"fit", fit_json(*fitted, command.fit.output)}},
         bake_line + fit_text(*fitted, command.fit.output));
  return 0;
}

}  // namespace selvedge
