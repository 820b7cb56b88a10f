// fit, and make, which is bake and fit with the mesh before.
#include <fmt/format.h>

#include "converter/tool/commands.h"
#include "converter/tool/run_bake.h"
#include "format/atomic_file.h"

namespace selvedge {
namespace {

Result<FitResult> fit_file(const std::string& samples, const FitCommand& command) {
  // Said before the work, not after it.
  if (const auto writable = AtomicFile::create(command.output); !writable) {
    return tl::unexpected(writable.error());
  }
  auto reader = SamplesReader::open(samples);
  if (!reader) return tl::unexpected(reader.error());
  auto level = reader->read_level();
  if (!level) return tl::unexpected(level.error());
  TerminalProgress progress("fit", command.common.quiet);
  auto result = fit(std::move(*level), reader->header(), command.fit, progress.callback());
  if (!result) {
    result.error().file = samples;
    return result;
  }
  if (auto ok = write_fabric(command.output, result->fabric, command.write); !ok) {
    return tl::unexpected(ok.error());
  }
  return result;
}

Json fit_json(const FitResult& r, const std::string& output) {
  Json levels = Json::array();
  for (const FitLevelReport& level : r.levels) {
    levels.push_back({{"texels", {level.width, level.height}},
                      {"trainingError", level.training_error},
                      {"rounds", level.mean_rounds},
                      {"unconverged", level.unconverged},
                      {"seconds", level.seconds}});
  }
  return {{"output", output}, {"bytes", size_of_file(output)}, {"seconds", r.seconds}, {"levels", levels}};
}

std::string fit_text(const FitResult& r, const std::string& output) {
  std::string text = "level  texels   training error  rounds  not converged  seconds\n";
  for (std::size_t k = 0; k < r.levels.size(); ++k) {
    const FitLevelReport& l = r.levels[k];
    text += fmt::format("{:5}  {:>7}  {:14.4f}  {:6.1f}  {:13}  {:7.2f}\n", k,
                        fmt::format("{}x{}", l.width, l.height), l.training_error, l.mean_rounds,
                        l.unconverged, l.seconds);
  }
  return text + fmt::format("fitted in {:.1f} s -> {} ({} bytes)\n", r.seconds, output, size_of_file(output));
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
