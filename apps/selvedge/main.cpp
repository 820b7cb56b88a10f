#include "apps/selvedge/commands.h"

int main(int argc, char** argv) {
  selvedge::Program program(
      "selvedge", "Selvedge makes fabric files from stitches and dresses glTF garments in them",
      "Each verb has its own --help with an example. Pictures are drawn by selvedge-view.");
  selvedge::add_verbs(program);
  return program.run(argc, argv);
}
