// Options that set all knobs of `make` at once, by quality or by limits.
#pragma once

#include "apps/common/options.h"
#include "apps/selvedge/command_line.h"

namespace selvedge {

/// Declares --quality, --max-bytes, --min-db and --max-seconds, sets the knobs, and refuses excluded options.
void add_choice(Options& options, MakeCommand& command);

}  // namespace selvedge
