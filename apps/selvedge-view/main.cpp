#include "apps/common/program.h"
#include "apps/selvedge-view/commands.h"

int main(int argc, char** argv) {
  return selvedge::run_program("selvedge-view", selvedge::parse_command_line, argc, argv);
}
