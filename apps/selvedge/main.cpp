#include "apps/common/program.h"
#include "apps/selvedge/commands.h"

int main(int argc, char** argv) {
  return selvedge::run_program("selvedge", selvedge::parse_command_line, argc, argv);
}
