// The verbs of selvedge: each function declares the options of one and what it runs.
#pragma once

#include "apps/common/program.h"

namespace selvedge {

using AddVerb = void(Program& program);
AddVerb add_stitch_verb, add_import_verb, add_bake_verb, add_fit_verb, add_make_verb, add_plan_verb,
    add_dress_verb, add_export_verb, add_check_verb, add_info_verb, add_evaluate_verb, add_compare_verb,
    add_truth_verb;
/// All of them.
AddVerb add_verbs;
/// The program with all of them and `more`; its exit status.
int run_selvedge(int argc, const char* const* argv, AddVerb* more = nullptr);

}  // namespace selvedge
