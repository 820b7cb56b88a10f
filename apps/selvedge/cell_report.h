// What was chosen, guessed or left out for a cell of cloth.
#pragma once

#include <string>
#include <vector>

#include "apps/common/report.h"
#include "converter/stitch/find_cell.h"

namespace selvedge {

/// One line each.
std::vector<std::string> remarks_of(const Cell& cell);

/// Those lines and the others on standard error, unless --quiet or --json.
void report_remarks(const CommonOptions& common, const std::string& input, const Cell& cell,
                    const std::vector<std::string>& others);

}  // namespace selvedge
