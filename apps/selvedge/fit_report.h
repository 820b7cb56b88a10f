// What a fit reports: for people a table, for programs JSON, and both as files.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/common/report.h"
#include "apps/selvedge/command_line.h"
#include "fitter/fit.h"
#include "format/quality/fit_record.h"

namespace selvedge {

struct FitLevelOutcome {
  int width = 0;
  int height = 0;
  std::optional<FitLevelReport> lobes;                             ///< where the level has them
  std::vector<std::pair<std::string, std::uint64_t>> layer_bytes;  ///< layers of the file by name, compressed
};

/// A fit that has been written.
struct FitOutcome {
  std::string samples;
  std::string output;
  std::uint64_t bytes = 0;         ///< of the file
  std::uint64_t shared_bytes = 0;  ///< of the bases, which are of no level
  FitRecord record;
  std::vector<FitLevelOutcome> levels;
  double seconds = 0;
};

/// Reads from the written file what it tells of itself: record, layers, bytes.
Result<void> look_up(FitOutcome& outcome);

Json fit_json(const FitOutcome& outcome);

/// A table for the terminal.
std::string fit_text(const FitOutcome& outcome);

/// The same and more as Markdown.
std::string fit_markdown(const FitOutcome& outcome);

/// JSON or Markdown, as the name says. `json`: the whole report of the verb.
Result<void> write_report(const std::string& path, const char* verb, const Json& json,
                          const FitOutcome& outcome);

}  // namespace selvedge
