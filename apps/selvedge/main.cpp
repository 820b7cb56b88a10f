#include <malloc.h>

#include "apps/selvedge/commands.h"

int main(int argc, char** argv) {
  // Freed large blocks go back to the system: glibc learns to keep them, 50 of 380 MB of a chart. Smaller
  // ones are kept: the system would clear their pages each time.
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  mallopt(M_TRIM_THRESHOLD, 64 << 20);
  return selvedge::run_selvedge(argc, argv);
}
