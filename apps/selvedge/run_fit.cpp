// fit: samples -> fabric file with a record of its errors.
#include "apps/selvedge/run_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "apps/common/paths.h"
#include "fitter/budget/file_budget.h"
#include "format/base/atomic_file.h"

namespace selvedge {
namespace {

/// Null without yarn.
std::shared_ptr<const Yarns> yarns_of(SamplesReader& reader) {
  if (reader.header().yarns.curves == 0) return nullptr;
  auto yarns = must(reader.read_yarns());
  return std::make_shared<const Yarns>(std::move(yarns), reader.header().period_mm);
}

/// Measures the errors of the fabric in the file's precision, and writes it.
void write_measured(SamplesReader& reader, const FitCommand& command, Fabric fitted,
                    const PairSamples& held_out, const PairSamples& training, FitRecord record) {
  fitted.levels.front().set_yarns(yarns_of(reader));
  const FabricWriteOptions& write = command.options.write;
  const Fabric fabric = as_stored(fitted, write.half);
  must(measure_errors(fabric, held_out, training, record));
  for (const Error& warning : precision_warnings({}, fitted, write)) record.warnings.push_back(warning);
  must(write_fabric(command.output, fabric, std::move(record), write));
}

/// Fits with layers selected per level within the budget.
std::vector<LevelReport> fit_layers(SamplesReader& reader, const FitCommand& command,
                                    const Progress& progress) {
  const MakeOptions& options = command.options;
  auto level = must(reader.read_level());
  const auto validation = must(reader.read_pairs(PairKind::validation));
  const auto fitter =
      must(LayerFitter::create(std::move(level), reader.header(), validation, options.fit, progress));
  const auto held_out = must(reader.read_pairs(PairKind::held_out));
  const double bytes = options.budget_for(reader.header().texels());
  std::shared_ptr<const Yarns> counted;
  if (options.budget_has_yarn) counted = yarns_of(reader);
  const auto chosen = must(choose_for_file(fitter, bytes, options.write, counted, command.output));
  write_measured(reader, command, chosen.fabric, held_out, fitter.training(),
                 {0, chosen.levels, fitter.warnings()});
  return chosen.levels;
}

/// Fits the paper's model at every level.
std::vector<LevelReport> fit_lobes(SamplesReader& reader, const FitCommand& command,
                                   const Progress& progress) {
  const auto result = must(fit(reader, command.options.fit, progress));
  // Read after the samples are freed, to save memory.
  const auto held_out = must(reader.read_pairs(PairKind::held_out));
  write_measured(reader, command, result.fabric, held_out, result.training,
                 {0, result.levels, result.warnings});
  return result.levels;
}

}  // namespace

FitOutcome fit_file(const std::string& samples, const FitCommand& command) {
  const auto start = std::chrono::steady_clock::now();
  must(
      check_distinct({{"the samples", samples}, {"--output", command.output}, {"--report", command.report}}));
  // Report an unwritable output before the work, not after it.
  for (const std::string& path : {command.output, command.report}) {
    if (path.empty()) continue;
    must(AtomicFile::create(path));
  }
  const auto named = [&](Error error) {
    if (error.file.empty() || error.file == samples) error.file = command.input;
    return error;
  };
  const auto fit_samples = [&] {
    auto reader = must(SamplesReader::open(samples));
    TerminalProgress progress("fit", command.common.quiet);
    return command.options.budget ? fit_layers(reader, command, progress.callback())
                                  : fit_lobes(reader, command, progress.callback());
  };
  FitOutcome outcome = read_outcome(command.output, changing_failures(fit_samples, named));
  outcome.samples = command.input;
  for (Error& warning : outcome.record.warnings) {
    warning.file = command.input;
    if (!(command.common.quiet || command.common.json)) report_issue(warning);
  }
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return outcome;
}

Result<int> run(const FitCommand& command) {
  const auto result = fit_file(command.input, command);
  const Json json = fit_json(result);
  write_report(command.report, "fit", json, result);
  report(command.common, "fit", json, fit_text(result));
  return 0;
}

}  // namespace selvedge
