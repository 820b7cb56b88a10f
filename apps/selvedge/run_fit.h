// What fit, make and trade share, and the make that chooses its settings.
#pragma once

#include "apps/selvedge/command_line.h"
#include "apps/selvedge/fit_report.h"
#include "format/base/atomic_file.h"

namespace selvedge {

/// Fits a samples file and writes the fabric, with progress. Messages call the samples command.input.
Result<FitOutcome> fit_file(const std::string& samples, const FitCommand& command);

/// An error of a file that is written beside `output`, or of one beside that, as one of `output`: the only
/// one of them that a user has named.
Error naming_output(Error error, const AtomicFile& beside, const std::string& output);

/// A fabric made from a stitch and written, with what there is to tell of it.
struct MadeFabric {
  Json json;         ///< of bake and fit
  std::string text;  ///< the same as a table
  FitOutcome fitted;
  double seconds = 0;  ///< to bake and fit
};
/// Mesh, bake and fit; the command's limits do not count.
Result<MadeFabric> make_fabric(const MakeCommand& command);

/// make with limits.
Result<int> run_within_limits(const MakeCommand& command);

// The verbs.
Result<int> run(const FitCommand& command);
Result<int> run(const MakeCommand& command);
Result<int> run(const TradeCommand& command);

}  // namespace selvedge
