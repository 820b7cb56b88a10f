// Remarks on a cell: choices, guesses and omissions.
#pragma once

#include <string>
#include <vector>

#include "apps/common/report.h"
#include "converter/stitch/find_cell.h"

namespace selvedge {

/// One line each.
std::vector<std::string> remarks_of(const Cell& cell);

/// Prints these lines and `others` on standard error, unless --quiet or --json.
void report_remarks(const CommonOptions& common, const std::string& input, const Cell& cell,
                    const std::vector<std::string>& others);

}  // namespace selvedge
