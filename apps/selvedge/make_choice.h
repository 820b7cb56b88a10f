// `make` by what its fabric is to be worth or to cost, instead of knob by knob.
#pragma once

#include "apps/common/options.h"
#include "apps/selvedge/command_line.h"

namespace selvedge {

/// --quality, --max-bytes, --min-db and --max-seconds, what they choose, and the options that they exclude.
void add_choice(Options& options, MakeCommand& command);

}  // namespace selvedge
