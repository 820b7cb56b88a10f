// Checks the files that a command names before its work begins.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

/// Takes pairs (role, path); empty paths are ignored. OPTION_OUT_OF_RANGE names two that are or would be the
/// same file.
Result<void> check_distinct(const std::vector<std::pair<std::string, std::string>>& paths);

/// Checks that each of these files can be created; empty paths are ignored. FILE_UNWRITABLE.
Result<void> check_writable(const std::vector<std::string>& paths);

}  // namespace selvedge
