// Checks the files that a command names before its work begins.
#pragma once

#include <string>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

/// The same text for all paths that lead to one file, whether it is there or not.
std::string identity_of(const std::string& path);

/// Checks that each of these files can be created; empty paths are ignored. FILE_UNWRITABLE.
Result<void> check_writable(const std::vector<std::string>& paths);

}  // namespace selvedge
