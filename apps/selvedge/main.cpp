#include <malloc.h>

#include "apps/selvedge/commands.h"

int main(int argc, char** argv) {
  // Freed large blocks go back to the system: glibc learns to keep them, 50 of 380 MB of a chart.
  mallopt(M_MMAP_THRESHOLD, 1 << 18);
  return selvedge::run_selvedge(argc, argv);
}
