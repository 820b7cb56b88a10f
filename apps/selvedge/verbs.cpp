#include "apps/selvedge/commands.h"

namespace selvedge {

void add_verbs(Program& program) {
  for (AddVerb* add : {add_stitch_verb, add_import_verb, add_bake_verb, add_fit_verb, add_make_verb,
                       add_plan_verb, add_dress_verb, add_export_verb, add_check_verb, add_info_verb,
                       add_evaluate_verb, add_compare_verb, add_truth_verb})
    add(program);
}

int run_selvedge(int argc, const char* const* argv, AddVerb* more) {
  Program program("selvedge", "Selvedge makes fabric files from stitches and dresses glTF garments in them",
                  "Each verb has its own --help with an example. Pictures are drawn by selvedge-view.");
  add_verbs(program);
  if (more) more(program);
  return program.run(argc, argv);
}

}  // namespace selvedge
