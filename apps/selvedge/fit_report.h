// The report of a fit: a table for people, JSON for programs, and both as files.
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
  std::string samples;
  std::string output;
  std::uint64_t bytes = 0;         ///< of the file
  std::uint64_t shared_bytes = 0;  ///< of the bases, which are of no level
  FitRecord record;
  double seconds = 0;
};

/// The report of a fabric that has been written: its record and sizes as they stand in the file, and of the
/// fit of each level the figures that the file does not keep.
Result<FitOutcome> read_outcome(const std::string& path, const std::vector<LevelReport>& fitted);

Json fit_json(const FitOutcome& outcome);

/// A table for the terminal.
std::string fit_text(const FitOutcome& outcome);

/// The same and more as Markdown.
std::string fit_markdown(const FitOutcome& outcome);

/// JSON or Markdown, as the name says. `json`: the whole report of the verb.
Result<void> write_report(const std::string& path, const char* verb, const Json& json,
                          const FitOutcome& outcome);

}  // namespace selvedge
