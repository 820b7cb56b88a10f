// Reports a fit: as a table for people, as JSON for programs.
#pragma once

#include <string>
#include <vector>

#include "apps/common/report.h"
#include "apps/selvedge/command_line.h"
#include "fitter/fit.h"
#include "format/quality/fit_record.h"

namespace selvedge {

/// A fit that has been written.
struct FitOutcome {
  std::string output;
  std::uint64_t bytes = 0;         ///< of the file
  std::uint64_t shared_bytes = 0;  ///< of the bases, which belong to no level
  Json yarn;                       ///< yarn_json()
  FitRecord record;
  double seconds = 0;
};

/// The yarn that a fabric file holds: `curves`, `nodes`, and `bytes` of both its layers in the file; null
/// without yarn.
Json yarn_json(const FabricReader& reader);
/// "8 curves, 320 nodes, 5123 bytes". Precondition: not null.
std::string yarn_text(const Json& yarn);

/// The report of a written fabric: its record and sizes from the file, and from `fitted` the figures of each
/// level that the file does not keep. Throws Failure.
FitOutcome read_outcome(const std::string& path, const std::vector<LevelReport>& fitted);

Json fit_json(const FitOutcome& outcome);

/// A table for the terminal.
std::string fit_text(const FitOutcome& outcome);

}  // namespace selvedge
