// What the verbs of selvedge-view do. Reports go to standard output, errors and remarks to standard error.
#pragma once

#include "viewer/command_line.h"

namespace selvedge {

/// The exit status: 0 good, 1 bad input, 2 usage.
int run(const RenderCommand& command);
int run(const CompareCommand& command);

}  // namespace selvedge
