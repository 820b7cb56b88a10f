// What fit, make and trade share.
#pragma once

#include "converter/tool/command_line.h"
#include "converter/tool/fit_report.h"

namespace selvedge {

/// Fits a samples file and writes the fabric, with progress; command.input does not count.
Result<FitOutcome> fit_file(const std::string& samples, const FitCommand& command);

}  // namespace selvedge
