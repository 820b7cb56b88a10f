// What the verbs of selvedge-view do. Reports go to standard output, errors and remarks to standard error.
#pragma once

#include "apps/selvedge-view/command_line.h"

namespace selvedge {

/// The exit status: 0 good, 1 bad input, 2 usage.
int run(const RenderCommand& command);
int run(const ShowCommand& command);
int run(const CompareCommand& command);
int run(const TradeCommand& command);

/// Mesa's rasteriser has threads of its own, which are limited here unless whoever set their number knows
/// better. 0: as many as it likes.
void limit_mesa_threads(int threads);

}  // namespace selvedge
