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
Result<std::shared_ptr<const Yarns>> yarns_of(SamplesReader& reader) {
  if (reader.header().yarns.curves == 0) return nullptr;
  auto yarns = reader.read_yarns();
  if (!yarns) return tl::unexpected(yarns.error());
  return std::make_shared<const Yarns>(std::move(*yarns), reader.header().period_mm);
}

/// Measures the errors of the fabric in the file's precision, and writes it.
Result<void> write_measured(SamplesReader& reader, const FitCommand& command, Fabric fitted,
                            const PairSamples& held_out, const PairSamples& training, FitRecord record) {
  auto yarns = yarns_of(reader);
  if (!yarns) return tl::unexpected(yarns.error());
  fitted.levels.front().set_yarns(std::move(*yarns));
  const FabricWriteOptions& write = command.options.write;
  const Fabric fabric = as_stored(fitted, write.half);
  if (auto ok = measure_errors(fabric, held_out, training, record); !ok) return ok;
  for (const Error& warning : precision_warnings({}, fitted, write)) record.warnings.push_back(warning);
  return write_fabric(command.output, fabric, std::move(record), write);
}

/// Fits with layers selected per level within the budget.
Result<std::vector<LevelReport>> fit_layers(SamplesReader& reader, const FitCommand& command,
                                            const Progress& progress) {
  const MakeOptions& options = command.options;
  auto level = reader.read_level();
  if (!level) return tl::unexpected(level.error());
  const auto validation = reader.read_pairs(PairKind::validation);
  if (!validation) return tl::unexpected(validation.error());
  const auto fitter =
      LayerFitter::create(std::move(*level), reader.header(), *validation, options.fit, progress);
  if (!fitter) return tl::unexpected(fitter.error());
  const auto held_out = reader.read_pairs(PairKind::held_out);
  if (!held_out) return tl::unexpected(held_out.error());
  const double bytes = options.budget_for(reader.header().texels());
  std::shared_ptr<const Yarns> counted;
  if (options.budget_has_yarn) {
    auto yarns = yarns_of(reader);
    if (!yarns) return tl::unexpected(yarns.error());
    counted = std::move(*yarns);
  }
  const auto chosen = choose_for_file(*fitter, bytes, options.write, counted, command.output);
  if (!chosen) return tl::unexpected(chosen.error());
  if (auto ok = write_measured(reader, command, chosen->fabric, *held_out, fitter->training(),
                               {0, chosen->levels, fitter->warnings()});
      !ok) {
    return tl::unexpected(ok.error());
  }
  return chosen->levels;
}

/// Fits the paper's model at every level.
Result<std::vector<LevelReport>> fit_lobes(SamplesReader& reader, const FitCommand& command,
                                           const Progress& progress) {
  const auto result = fit(reader, command.options.fit, progress);
  if (!result) return tl::unexpected(result.error());
  // Read after the samples are freed, to save memory.
  const auto held_out = reader.read_pairs(PairKind::held_out);
  if (!held_out) return tl::unexpected(held_out.error());
  if (auto ok = write_measured(reader, command, result->fabric, *held_out, result->training,
                               {0, result->levels, result->warnings});
      !ok) {
    return tl::unexpected(ok.error());
  }
  return result->levels;
}

}  // namespace

Result<FitOutcome> fit_file(const std::string& samples, const FitCommand& command) {
  const auto start = std::chrono::steady_clock::now();
  const auto distinct =
      check_distinct({{"the samples", samples}, {"--output", command.output}, {"--report", command.report}});
  if (!distinct) return tl::unexpected(distinct.error());
  // Report an unwritable output before the work, not after it.
  for (const std::string& path : {command.output, command.report}) {
    if (path.empty()) continue;
    if (const auto writable = AtomicFile::create(path); !writable) return tl::unexpected(writable.error());
  }
  const auto named = [&](Error error) {
    if (error.file.empty() || error.file == samples) error.file = command.input;
    return error;
  };
  auto reader = SamplesReader::open(samples);
  if (!reader) return tl::unexpected(named(reader.error()));
  TerminalProgress progress("fit", command.common.quiet);
  const auto levels = command.options.budget ? fit_layers(*reader, command, progress.callback())
                                             : fit_lobes(*reader, command, progress.callback());
  if (!levels) return tl::unexpected(named(levels.error()));
  auto outcome = read_outcome(command.output, *levels);
  if (!outcome) return outcome;
  outcome->samples = command.input;
  for (Error& warning : outcome->record.warnings) {
    warning.file = command.input;
    if (!(command.common.quiet || command.common.json)) report_issue(warning);
  }
  outcome->seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return outcome;
}

Result<int> run(const FitCommand& command) {
  const auto result = fit_file(command.input, command);
  if (!result) return tl::unexpected(result.error());
  const Json json = fit_json(*result);
  if (!command.report.empty()) {
    if (auto ok = write_report(command.report, "fit", json, *result); !ok) return tl::unexpected(ok.error());
  }
  report(command.common, "fit", json, fit_text(*result));
  return 0;
}

}  // namespace selvedge
