// The verbs of selvedge-view: each function declares one with its options and what runs it.
#pragma once

#include "apps/common/program.h"

namespace selvedge {

void add_render_verb(Program& program);
void add_show_verb(Program& program);
void add_compare_verb(Program& program);
void add_trade_verb(Program& program);

/// Mesa's rasteriser has threads of its own, which are limited here unless whoever set their number knows
/// better. 0: as many as it likes.
void limit_mesa_threads(int threads);

}  // namespace selvedge
