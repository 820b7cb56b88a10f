// make: mesh, bake and fit in one.
#include "apps/selvedge/run_make.h"

#include "apps/common/paths.h"
#include "apps/selvedge/bake.h"
#include "apps/selvedge/run_fit.h"
#include "converter/bake/for_plan.h"
#include "converter/plan/plan_file.h"

namespace selvedge {

Error naming_output(Error error, const AtomicFile& beside, const std::string& output) {
  if (error.file.starts_with(beside.temporary())) error.file = output;
  return error;
}

Result<MadeFabric> make_fabric(const MakeCommand& command) {
  const auto distinct = check_distinct({{"the input", command.input},
                                        {"--output", command.output},
                                        {"--keep-samples", command.samples},
                                        {"--report", command.report},
                                        {"--for", command.plan}});
  if (!distinct) return tl::unexpected(distinct.error());
  BakeCommand bake;
  bake.input = command.input;
  bake.cell = command.cell;
  bake.bake = command.options.bake;
  bake.pairs = command.pairs;
  bake.texels_given = command.texels_given;
  FitCommand fit;
  fit.common = command.common;
  fit.options = command.options;
  fit.output = command.output;
  fit.report = command.report;
  if (!command.plan.empty()) {
    const auto demand = read_plan(command.plan, command.materials);
    if (!demand) return tl::unexpected(demand.error());
    bake.demand = *demand;
    bake.chooses = fit.options.budget.has_value();
  }
  // The samples pass through a file, as between the single verbs: without --keep-samples a temporary one
  // beside the fabric.
  auto passing = AtomicFile::create(command.output);
  if (!passing) return tl::unexpected(passing.error());
  const auto named = [&](const Error& error) {
    return tl::unexpected(naming_output(error, *passing, command.output));
  };
  const bool keep = !command.samples.empty();
  bake.output = keep ? command.samples : passing->temporary();
  if (!keep) bake.bake.resumable = false;
  fit.input = keep ? command.samples : command.input;
  const auto baked = bake_cell(bake, command.common);
  if (!baked) return named(baked.error());
  Json bake_report = bake_json(*baked, bake.output);
  if (!keep) bake_report.erase("output");
  const std::string bake_line = bake_text(*baked, command.samples);
  // The selection of layers needs all levels at once.
  if (bake.demand && !fit.options.budget) {
    const auto samples = SamplesReader::open(bake.output);
    if (!samples) return named(samples.error());
    fit.options.fit.levels = levels_needed(*bake.demand, samples->header());
    fit.options.fit.partial = true;
  }
  auto fitted = fit_file(bake.output, fit);
  if (!fitted) return named(fitted.error());
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
  if (!command.report.empty()) {
    if (auto ok = write_report(command.report, "make", made->json, made->fitted); !ok)
      return tl::unexpected(ok.error());
  }
  report(command.common, "make", made->json, made->text);
  return 0;
}

}  // namespace selvedge
