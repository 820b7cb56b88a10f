// Makes a fabric from a cell and writes it: of the verb make, with and without limits.
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
/// Mesh, bake and fit; the command's limits do not count.
Result<MadeFabric> make_fabric(const MakeCommand& command);

/// An error of a file that is written beside `output`, or of one beside that, as one of `output`: the only
/// one of them that a user has named.
Error naming_output(Error error, const AtomicFile& beside, const std::string& output);

/// make with limits.
Result<int> run_within_limits(const MakeCommand& command);

}  // namespace selvedge
