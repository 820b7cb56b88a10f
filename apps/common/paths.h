// Checks of the files that a command names, before its work begins.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

/// (what it is, path); empty paths do not count. OPTION_OUT_OF_RANGE names two that are the same file, or
/// would be.
Result<void> check_distinct(const std::vector<std::pair<std::string, std::string>>& paths);

/// Whether each of these files could be made; empty paths do not count. FILE_UNWRITABLE.
Result<void> check_writable(const std::vector<std::string>& paths);

}  // namespace selvedge
