// The verbs of selvedge-view: each function declares the options of one and what it runs.
#pragma once

#include "apps/common/program.h"

namespace selvedge {

void add_render_verb(Program& program);
void add_show_verb(Program& program);
void add_page_verb(Program& program);
void add_design_verb(Program& program);
void add_trade_verb(Program& program);

/// Limits the threads of Mesa's rasteriser, unless its environment variable is set. 0: no limit.
void limit_mesa_threads(int threads);

}  // namespace selvedge
