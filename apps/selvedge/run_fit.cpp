// fit: samples -> fabric file with a record of its errors.
#include "apps/selvedge/run_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>

#include "apps/selvedge/made_of.h"
#include "fitter/budget/file_budget.h"

namespace selvedge {
namespace {

/// Null without yarn.
std::shared_ptr<const Yarns> yarns_of(SamplesReader& reader) {
  if (reader.header().yarns.curves == 0) return nullptr;
  auto yarns = must(reader.read_yarns());
  return std::make_shared<const Yarns>(std::move(yarns), reader.header().period_mm);
}

/// The fit of one side of the cloth.
struct SideFit {
  Fabric fabric;
  std::vector<LevelReport> levels;
  PairSamples training;
  Issues warnings;
};

/// What the other sides get of the budget, by Side: light that comes through is smooth.
constexpr std::array<double, all_sides.size()> budget_shares{1, 0.5, 0.4, 0.4};
/// Bytes of a side's parts and members beside its values, about.
constexpr double overhead_of_side = 4500;

/// Fits with layers selected per level within the budget.
SideFit fit_layers(SamplesReader& reader, const FitCommand& command, Side side, const Progress& progress) {
  const MakeOptions& options = command.options;
  auto level = must(reader.read_level());
  const auto validation = must(reader.read_pairs(PairKind::validation));
  const auto fitter = must(LayerFitter::create(std::move(level), reader.header(), validation, options.fit,
                                               progress, must(reader.read_pairs(PairKind::measured))));
  const double bytes = options.budget_for(reader.header().texels()) * budget_shares[index_of(side)];
  std::shared_ptr<const Yarns> counted;
  if (options.budget_has_yarn) counted = yarns_of(reader);
  LayerFit chosen = side == Side::front
                        ? must(choose_for_file(fitter, bytes, options.write, counted, command.output))
                        : fitter.choose(bytes, overhead_of_side);
  return {std::move(chosen.fabric), std::move(chosen.levels), fitter.training(), fitter.warnings()};
}

/// Fits the paper's model at every level.
SideFit fit_lobes(SamplesReader& reader, const FitCommand& command, const Progress& progress) {
  auto result = must(fit(reader, command.options.fit, progress));
  return {std::move(result.fabric), std::move(result.levels), std::move(result.training),
          std::move(result.warnings)};
}

/// Fits all sides of the samples, measures their errors in the file's precision, and writes the fabric.
FitRecord fit_sides(SamplesReader& reader, const FitCommand& command) {
  const FabricWriteOptions& write = command.options.write;
  Fabric fabric;
  FitRecord record;
  for (const Side side : all_sides) {
    if (side != Side::front && !reader.header().both_sides) break;
    reader.select(side);
    const std::string label = side == Side::front ? "fit" : fmt::format("fit {}", name_of(side));
    TerminalProgress progress(label, command.common.quiet);
    SideFit fitted = command.options.budget ? fit_layers(reader, command, side, progress.callback())
                                            : fit_lobes(reader, command, progress.callback());
    auto& levels = side == Side::front ? record.levels : record.sides[index_of(side) - 1];
    levels = std::move(fitted.levels);
    // Read after the samples are freed, to save memory.
    const auto held_out = must(reader.read_pairs(PairKind::held_out));
    double peak = 0;
    must(measure_errors(as_stored(fitted.fabric, write.half), held_out, fitted.training, peak, levels));
    std::move(fitted.warnings.begin(), fitted.warnings.end(), std::back_inserter(record.warnings));
    fitted.fabric.side = side;
    if (side == Side::front) {
      record.peak = peak;
      fabric = std::move(fitted.fabric);
      fabric.levels.front().set_yarns(yarns_of(reader));
    } else {
      fitted.fabric.provenance = "{}";
      fabric.add_side(std::move(fitted.fabric));
    }
  }
  if (!command.made_of.empty()) fabric.provenance = with_inputs(fabric.provenance, command.made_of);
  for (const Error& warning : precision_warnings({}, fabric, write)) record.warnings.push_back(warning);
  must(write_fabric(command.output, as_stored(fabric, write.half), record, write));
  return record;
}

}  // namespace

FitOutcome fit_file(const std::string& samples, const FitCommand& command) {
  const auto start = std::chrono::steady_clock::now();
  const auto named = [&](Error error) {
    if (error.file.empty() || error.file == samples) error.file = command.input;
    return error;
  };
  const auto fit_samples = [&] {
    auto reader = must(SamplesReader::open(samples));
    return fit_sides(reader, command);
  };
  FitOutcome outcome = read_outcome(command.output, changing_failures(fit_samples, named).levels);
  for (Error& warning : outcome.record.warnings) {
    warning.file = command.input;
    if (!(command.common.quiet || command.common.json)) report_issue(warning);
  }
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return outcome;
}

Result<int> run(const FitCommand& command) {
  const auto result = fit_file(command.input, command);
  report(command.common, "fit", fit_json(result), fit_text(result));
  return 0;
}

}  // namespace selvedge
