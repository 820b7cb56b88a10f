// No file of a command may be written over another of its own.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

/// (what it is, path); empty paths do not count. OPTION_OUT_OF_RANGE names two that are the same file, or
/// would be.
Result<void> check_distinct(const std::vector<std::pair<std::string, std::string>>& paths);

}  // namespace selvedge
