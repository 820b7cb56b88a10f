// The bake of the verbs bake and make.
#pragma once

#include "apps/selvedge/cell_report.h"
#include "apps/selvedge/command_line.h"

namespace selvedge {

/// Loads the cell and bakes it, with progress.
Result<BakeReport> bake_cell(const BakeCommand& command, const CommonOptions& common);

Json bake_json(const BakeReport& report, const std::string& output);
std::string bake_text(const BakeReport& report, const std::string& output);

}  // namespace selvedge
