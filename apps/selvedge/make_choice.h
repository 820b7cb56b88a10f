// `make` by what its fabric is to be worth or to cost, instead of knob by knob.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "apps/selvedge/command_line.h"

namespace selvedge {

/// --quality, --max-bytes, --min-db and --max-seconds.
void add_choice(CLI::App& app, std::string& quality, MakeLimits& limits);

/// Refuses, as a usage error, options that the limits choose or do not know of.
void check_choice(const CLI::App& make, const MakeLimits& limits);

/// MakeCommand::given of what the command line has.
std::string given_options(const CLI::App& make);

}  // namespace selvedge
