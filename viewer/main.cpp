#include "format/program.h"
#include "viewer/commands.h"

int main(int argc, char** argv) {
  return selvedge::run_program("selvedge-view", selvedge::parse_command_line, argc, argv);
}
