// `make` by the quality or the cost of its fabric, instead of knob by knob.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "apps/selvedge/command_line.h"

namespace selvedge {

/// --quality, --max-bytes, --min-db and --max-seconds.
void add_choice(CLI::App& app, MakeCommand& command);

/// Gives the knobs that are not on the command line the preset's values. Refuses, as a usage error, options
/// that the limits choose or exclude.
void apply_choice(const CLI::App& make, MakeCommand& command);

}  // namespace selvedge
