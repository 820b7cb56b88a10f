// Fits a samples file and writes the fabric, for the verbs fit and make.
#pragma once

#include "apps/selvedge/command_line.h"
#include "apps/selvedge/fit_report.h"

namespace selvedge {

/// Shows progress. Messages name the samples command.input. Throws Failure.
FitOutcome fit_file(const std::string& samples, const FitCommand& command);

// The verbs.
Result<int> run(const FitCommand& command);
Result<int> run(const MakeCommand& command);

}  // namespace selvedge
