#include <malloc.h>

#include "apps/selvedge/commands.h"

int main(int argc, char** argv) {
  // Freed large blocks go back to the system: glibc learns to keep them, 50 of 380 MB of a chart.
  mallopt(M_MMAP_THRESHOLD, 1 << 18);
  selvedge::Program program(
      "selvedge", "Selvedge makes fabric files from stitches and dresses glTF garments in them",
      "Each verb has its own --help with an example. Pictures are drawn by selvedge-view.");
  selvedge::add_verbs(program);
  return program.run(argc, argv);
}
