// make: mesh, bake and fit in one.
#include "apps/selvedge/run_make.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>

#include "apps/selvedge/bake.h"
#include "apps/selvedge/made_of.h"
#include "apps/selvedge/run_fit.h"
#include "converter/bake/journal.h"

namespace selvedge {

Error naming_output(Error error, const AtomicFile& beside, const std::string& output) {
  if (error.file.starts_with(beside.temporary())) error.file = output;
  return error;
}

namespace {

BakeCommand bake_of(const MakeCommand& command) {
  BakeCommand bake;
  bake.input = command.input;
  bake.cell = command.cell;
  bake.bake = command.options.bake;
  bake.texels_given = command.texels_given;
  bake.bounces_given = command.bounces_given;
  return bake;
}

/// Merges the parts of a bake that lie beside the output; the first that is missing is named with the command
/// that bakes it.
BakeReport merge_parts(const MakeCommand& command, const std::string& samples) {
  std::vector<std::string> parts;
  std::vector<std::string> missing;
  for (int i = 0; i < command.shards; ++i) {
    const BakeShard shard{i, command.shards};
    parts.push_back(part_of(command, shard));
    if (!BakeJournal::read(parts.back())) missing.push_back(fmt::format("{}/{}", i, command.shards));
  }
  if (!missing.empty()) {
    throw Failure{{Code::file_missing, command.output, "--shards",
                   fmt::format("lacks part{} {} of its bake: {} --shard {}", missing.size() == 1 ? "" : "s",
                               fmt::join(missing, ", "), command.line, missing.front())}};
  }
  return must(merge_shards(parts, samples));
}

}  // namespace

std::string part_of(const MakeCommand& command, const BakeShard& shard) {
  const std::string digest = must(digest_of_inputs(command)).substr(0, 8);
  return fmt::format("{}.{}.part-{}-of-{}", command.output, digest, shard.index, shard.count);
}

BakeReport bake_part(const MakeCommand& command, const BakeShard& shard) {
  BakeCommand bake = bake_of(command);
  bake.shard = shard;
  bake.output = part_of(command, shard);
  return must(bake_cell(bake, command.common));
}

MadeFabric make_fabric(const MakeCommand& command) {
  BakeCommand bake = bake_of(command);
  FitCommand fit;
  if (command.recorded) fit.made_of = must(digest_of_inputs(command));
  fit.common = command.common;
  fit.options = command.options;
  fit.output = command.output;
  // The samples pass through a file, as between the single verbs: without --keep-samples a temporary one
  // beside the fabric.
  const auto passing = must(AtomicFile::create(command.output));
  const bool keep = !command.samples.empty();
  bake.output = keep ? command.samples : passing.temporary();
  if (!keep) bake.bake.resumable = false;
  fit.input = keep ? command.samples : command.input;
  const auto bake_and_fit = [&] {
    const BakeReport baked =
        command.shards > 0 ? merge_parts(command, bake.output) : must(bake_cell(bake, command.common));
    Json bake_report = bake_json(baked, bake.output);
    if (!keep) bake_report.erase("output");
    FitOutcome fitted = fit_file(bake.output, fit);
    for (int i = 0; i < command.shards; ++i) {
      std::error_code none;
      std::filesystem::remove(part_of(command, {i, command.shards}), none);
    }
    return MadeFabric{{{"bake", bake_report}, {"fit", fit_json(fitted)}},
                      bake_text(baked, command.samples) + fit_text(fitted),
                      fitted,
                      baked.seconds + fitted.seconds};
  };
  return changing_failures(bake_and_fit,
                           [&](const Error& error) { return naming_output(error, passing, command.output); });
}

MadeFabric make_as_asked(const MakeCommand& command) {
  MadeFabric made = command.limits.any() ? make_within_limits(command) : make_fabric(command);
  if (!command.depfile.empty()) must(write_depfile(command.depfile, command));
  return made;
}

Result<int> run(const MakeCommand& command) {
  if (!command.list.path.empty()) return run_list(command.common, command.list);
  if (command.shard) {
    const BakeReport baked = bake_part(command, *command.shard);
    const std::string part = part_of(command, *command.shard);
    report(command.common, "make", {{"bake", bake_json(baked, part)}}, bake_text(baked, part));
    return 0;
  }
  const MadeFabric made = make_as_asked(command);
  report(command.common, "make", made.json, made.text);
  return 0;
}

}  // namespace selvedge
