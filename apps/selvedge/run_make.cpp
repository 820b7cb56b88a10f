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

MadeFabric make_fabric(const MakeCommand& command) {
  must(check_distinct({{"the input", command.input},
                       {"--output", command.output},
                       {"--keep-samples", command.samples},
                       {"--for", command.plan}}));
  BakeCommand bake;
  bake.input = command.input;
  bake.cell = command.cell;
  bake.bake = command.options.bake;
  bake.texels_given = command.texels_given;
  bake.sides_given = command.sides_given;
  bake.bounces_given = command.bounces_given;
  FitCommand fit;
  fit.common = command.common;
  fit.options = command.options;
  fit.output = command.output;
  if (!command.plan.empty()) {
    bake.demand = must(read_plan(command.plan, command.materials));
    bake.chooses = fit.options.budget.has_value();
  }
  // The samples pass through a file, as between the single verbs: without --keep-samples a temporary one
  // beside the fabric.
  const auto passing = must(AtomicFile::create(command.output));
  const bool keep = !command.samples.empty();
  bake.output = keep ? command.samples : passing.temporary();
  if (!keep) bake.bake.resumable = false;
  fit.input = keep ? command.samples : command.input;
  const auto bake_and_fit = [&] {
    const BakeReport baked = must(bake_cell(bake, command.common));
    Json bake_report = bake_json(baked, bake.output);
    if (!keep) bake_report.erase("output");
    // The selection of layers needs all levels at once.
    if (bake.demand && !fit.options.budget) {
      fit.options.fit.levels = levels_needed(*bake.demand, must(SamplesReader::open(bake.output)).header());
      fit.options.fit.partial = true;
    }
    FitOutcome fitted = fit_file(bake.output, fit);
    return MadeFabric{{{"bake", bake_report}, {"fit", fit_json(fitted)}},
                      bake_text(baked, command.samples) + fit_text(fitted),
                      fitted,
                      baked.seconds + fitted.seconds};
  };
  return changing_failures(bake_and_fit,
                           [&](const Error& error) { return naming_output(error, passing, command.output); });
}

Result<int> run(const MakeCommand& command) {
  if (command.limits.any()) return run_within_limits(command);
  const auto made = make_fabric(command);
  report(command.common, "make", made.json, made.text);
  return 0;
}

}  // namespace selvedge
