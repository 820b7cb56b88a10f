// Options of slabs that would be taken without a word and change nothing.
#pragma once

#include <CLI/CLI.hpp>

#include "apps/selvedge/command_line.h"

namespace selvedge {

/// Refuses, as usage errors, options of slabs where none can come of them. The commands are those that were
/// parsed, qualities and all; `app` has the verbs bake, fit and make.
void check_slabs(const CLI::App& app, const BakeCommand& bake, const FitCommand& fit,
                 const MakeCommand& make);

}  // namespace selvedge
