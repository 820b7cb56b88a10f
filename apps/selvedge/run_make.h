// Makes a fabric from a cell and writes it, for the verb make with and without limits.
#pragma once

#include "apps/selvedge/command_line.h"
#include "apps/selvedge/fit_report.h"
#include "format/base/atomic_file.h"

namespace selvedge {

struct MadeFabric {
  Json json;         ///< of bake and fit
  std::string text;  ///< the same as a table
  FitOutcome fitted;
  double seconds = 0;  ///< to bake and fit
};
/// Meshes, bakes and fits; the command's limits are ignored. Throws Failure.
MadeFabric make_fabric(const MakeCommand& command);

/// Converts an error of a temporary file beside `output` to one of `output`, which is the only name that the
/// user knows.
Error naming_output(Error error, const AtomicFile& beside, const std::string& output);

/// Where a part of a fabric's bake lies: "OUTPUT.1a2b3c4d.part-3-of-8", with the first digits of the digest
/// of what it is made of. Throws Failure.
std::string part_of(const MakeCommand& command, const BakeShard& shard);
/// Bakes the part of the fabric's samples; one that is there already is read and kept. Throws Failure.
BakeReport bake_part(const MakeCommand& command, const BakeShard& shard);

/// make with --list.
Result<int> run_list(const CommonOptions& common, const ListOptions& list);
/// make with limits. Throws Failure.
MadeFabric make_within_limits(const MakeCommand& command);
/// With limits if there are some; writes the depfile. Throws Failure.
MadeFabric make_as_asked(const MakeCommand& command);

}  // namespace selvedge
