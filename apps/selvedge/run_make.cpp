// fit, and make, which is bake and fit with the mesh before.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "apps/common/paths.h"
#include "apps/selvedge/bake.h"
#include "apps/selvedge/fit_report.h"
#include "apps/selvedge/run_fit.h"
#include "converter/bake/for_plan.h"
#include "converter/plan/plan_file.h"
#include "fitter/budget/candidates.h"
#include "format/base/atomic_file.h"

namespace selvedge {
namespace {

/// Record of the fit of the paper's model.
FitRecordLevel record_of(const FitLevelReport& level) {
  FitRecordLevel record;
  record.iterations = level.mean_iterations;
  record.converged = level.width * level.height - level.unconverged;
  record.at_limit = level.unconverged;
  return record;
}

/// Judges the fabric as the file will hold it, and writes it.
Result<void> write_judged(const FitCommand& command, const Fabric& fitted, const PairSamples& held_out,
                          const PairSamples& training, FitRecord record) {
  const Fabric fabric = as_stored(fitted, command.write.half);
  if (auto ok = judge(fabric, held_out, training, record); !ok) return ok;
  for (const Error& warning : precision_warnings({}, fitted, command.write))
    record.warnings.push_back(warning);
  return write_fabric(command.output, fabric, std::move(record), command.write);
}

/// The record of a choice of layers, as yet without its errors.
FitRecord record_of(const LayerFit& chosen, const Issues& warnings) {
  FitRecord record;
  for (const LevelChoice& level : chosen.levels) {
    record.levels.push_back(level.lobes ? record_of(*level.lobes) : FitRecordLevel());
    record.levels.back().validation = std::sqrt(level.validation_error);
  }
  record.warnings = warnings;
  return record;
}

/// Bytes for a fabric of so many texels at its level 0.
double budget_for(const FitCommand& command, int texels) {
  const double share = command.budget_texels > 0 ? static_cast<double>(texels) / command.budget_texels : 1;
  return static_cast<double>(*command.budget) * std::max(share, 1.0);
}

/// Chooses layers so that the file is not larger than the budget. Sizes are estimated before, so it takes
/// some tries beside the file's place; the largest that fits is kept, or the smallest where none does and
/// that was asked for.
Result<LayerFit> choose_within(const LayerFitter& fitter, const FitCommand& command, double budget) {
  constexpr int max_tries = 6;
  // In the place of errors that are not known yet, and longer in text than any.
  constexpr FitError unknown{1'000'000, -1000, -1000};
  const auto beside = AtomicFile::create(command.output);
  if (!beside) return tl::unexpected(beside.error());
  double overhead = LayerFitter::typical_overhead;
  double best = 0;
  double best_overhead = overhead;
  double smallest = std::numeric_limits<double>::infinity();
  double smallest_overhead = overhead;
  for (int i = 1;; ++i) {
    LayerFit chosen = fitter.choose(budget, overhead);
    FitRecord record = record_of(chosen, fitter.warnings());
    record.peak = -1.23456e-300;
    for (FitRecordLevel& level : record.levels) level.held_out = level.training = unknown;
    if (auto ok = write_fabric(beside->temporary(), chosen.fabric, std::move(record), command.write); !ok) {
      Error error = ok.error();
      error.file = command.output;
      return tl::unexpected(std::move(error));
    }
    const auto written = static_cast<double>(size_of_file(beside->temporary()));
    const bool fits = written <= budget;
    if (written < smallest) {
      smallest = written;
      smallest_overhead = overhead;
    }
    if (fits && written > best) {
      best = written;
      best_overhead = overhead;
    }
    if (fits && (i > max_tries || written > 0.98 * budget)) return chosen;
    if (i > max_tries) {
      if (command.smallest_at_least) return chosen;
      return fail(Code::option_out_of_range, command.output, "--budget",
                  fmt::format("{:.0f} bytes; the smallest fabric found has {:.0f}", budget, smallest));
    }
    // What the estimate missed, and a little more.
    const double missed = written - chosen.bytes;
    if (i == max_tries && (best > 0 || command.smallest_at_least)) {
      overhead = best > 0 ? best_overhead : smallest_overhead;
    } else {
      overhead += missed + (fits ? 0 : 0.002 * budget);
    }
  }
}

/// How the levels were fitted that have lobes.
using LobeReports = std::vector<std::optional<FitLevelReport>>;

Result<LobeReports> fit_layers(SamplesReader& reader, const FitCommand& command, const Progress& progress) {
  auto level = reader.read_level();
  if (!level) return tl::unexpected(level.error());
  const auto validation = reader.read_pairs(PairKind::validation);
  if (!validation) return tl::unexpected(validation.error());
  std::optional<HeightLayer> heights;
  if (reader.header().slabs) {
    auto read = reader.read_heights();
    if (!read) return tl::unexpected(read.error());
    heights = std::move(*read);
  }
  if (command.fit.glossy_slabs && (!heights || command.fit.slab_lobes == 0)) {
    return fail(Code::option_out_of_range, command.output, "--glossy-slabs",
                heights ? "wants --slab-lobes above 0" : "wants samples with heights: bake --slabs");
  }
  const auto fitter =
      LayerFitter::create(std::move(*level), reader.header(), heights, *validation, command.fit, progress);
  if (!fitter) return tl::unexpected(fitter.error());
  const auto held_out = reader.read_pairs(PairKind::held_out);
  if (!held_out) return tl::unexpected(held_out.error());
  const auto chosen = choose_within(*fitter, command, budget_for(command, reader.header().texels()));
  if (!chosen) return tl::unexpected(chosen.error());
  if (auto ok = write_judged(command, chosen->fabric, *held_out, fitter->training(),
                             record_of(*chosen, fitter->warnings()));
      !ok) {
    return tl::unexpected(ok.error());
  }
  LobeReports lobes;
  for (const LevelChoice& choice : chosen->levels) lobes.push_back(choice.lobes);
  return lobes;
}

/// Everything as lobes.
Result<LobeReports> fit_lobes(SamplesReader& reader, const FitCommand& command, const Progress& progress) {
  const auto result = fit(reader, command.fit, progress);
  if (!result) return tl::unexpected(result.error());
  // Read when the samples are gone again: what is held at a time stays small.
  const auto held_out = reader.read_pairs(PairKind::held_out);
  if (!held_out) return tl::unexpected(held_out.error());
  FitRecord record;
  for (const FitLevelReport& level : result->levels) record.levels.push_back(record_of(level));
  record.warnings = result->warnings;
  if (auto ok = write_judged(command, result->fabric, *held_out, result->training, record); !ok) {
    return tl::unexpected(ok.error());
  }
  return LobeReports(result->levels.begin(), result->levels.end());
}

}  // namespace

Result<FitOutcome> fit_file(const std::string& samples, const FitCommand& command) {
  const auto start = std::chrono::steady_clock::now();
  const auto distinct =
      check_distinct({{"the samples", samples}, {"--output", command.output}, {"--report", command.report}});
  if (!distinct) return tl::unexpected(distinct.error());
  // Said before the work, not after it.
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
  const auto lobes = command.budget ? fit_layers(*reader, command, progress.callback())
                                    : fit_lobes(*reader, command, progress.callback());
  if (!lobes) return tl::unexpected(named(lobes.error()));
  FitOutcome outcome;
  outcome.samples = command.input;
  outcome.output = command.output;
  if (auto ok = look_up(outcome); !ok) return tl::unexpected(ok.error());
  for (std::size_t k = 0; k < lobes->size(); ++k) outcome.levels[k].lobes = (*lobes)[k];
  for (Error& warning : outcome.record.warnings) {
    warning.file = command.input;
    if (!(command.common.quiet || command.common.json)) report_issue(warning);
  }
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
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

Error naming_output(Error error, const AtomicFile& beside, const std::string& output) {
  if (error.file.starts_with(beside.temporary())) error.file = output;
  return error;
}

Result<MadeFabric> make_fabric(const MakeCommand& command) {
  const auto distinct = check_distinct({{"the input", command.bake.input},
                                        {"--output", command.fit.output},
                                        {"--keep-samples", command.bake.output},
                                        {"--report", command.fit.report},
                                        {"--for", command.plan}});
  if (!distinct) return tl::unexpected(distinct.error());
  BakeCommand bake_command = command.bake;
  FitCommand fit_command = command.fit;
  if (!command.plan.empty()) {
    const auto demand = read_plan(command.plan, command.materials);
    if (!demand) return tl::unexpected(demand.error());
    bake_command.demand = *demand;
    bake_command.chooses = fit_command.budget.has_value();
  }
  // The samples pass through a file, as they do between the single verbs; without --keep-samples through one
  // beside the fabric that is gone afterwards, whatever happens.
  auto passing = AtomicFile::create(command.fit.output);
  if (!passing) return tl::unexpected(passing.error());
  const bool keep = !bake_command.output.empty();
  if (!keep) {
    bake_command.output = passing->temporary();
    bake_command.bake.resumable = false;
  }
  fit_command.input = keep ? bake_command.output : command.bake.input;
  const auto baked = bake_cell(bake_command, command.fit.common);
  if (!baked) return tl::unexpected(naming_output(baked.error(), *passing, command.fit.output));
  Json bake_report = bake_json(*baked, bake_command.output);
  if (!keep) bake_report.erase("output");
  const std::string bake_line = bake_text(*baked, keep ? bake_command.output : "");
  // A choice of layers weighs all levels against each other.
  if (bake_command.demand && !fit_command.budget) {
    const auto samples = SamplesReader::open(bake_command.output);
    if (!samples) return tl::unexpected(naming_output(samples.error(), *passing, command.fit.output));
    fit_command.fit.levels = levels_needed(*bake_command.demand, samples->header());
    fit_command.fit.partial = true;
  }
  auto fitted = fit_file(bake_command.output, fit_command);
  if (!fitted) return tl::unexpected(naming_output(fitted.error(), *passing, command.fit.output));
  MadeFabric made;
  made.json = {{"bake", bake_report}, {"fit", fit_json(*fitted)}};
  made.text = bake_line + fit_text(*fitted);
  made.seconds = baked->seconds + fitted->seconds;
  made.fitted = std::move(*fitted);
  return made;
}

Result<int> run(const MakeCommand& command) {
  if (command.limits.any()) return run_within_limits(command);
  const auto made = make_fabric(command);
  if (!made) return tl::unexpected(made.error());
  if (!command.fit.report.empty()) {
    if (auto ok = write_report(command.fit.report, "make", made->json, made->fitted); !ok)
      return tl::unexpected(ok.error());
  }
  report(command.fit.common, "make", made->json, made->text);
  return 0;
}

}  // namespace selvedge
