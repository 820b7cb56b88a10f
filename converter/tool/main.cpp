#include "converter/tool/commands.h"
#include "format/program.h"

int main(int argc, char** argv) {
  return selvedge::run_program("selvedge", selvedge::parse_command_line, argc, argv);
}
