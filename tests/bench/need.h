// Shared by the programs of tests/bench: errors that end them, and a clock.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <utility>

#include "format/base/error.h"

namespace selvedge::bench {

template <class T>
T need(Result<T> result) {
  if (!result) {
    std::fprintf(stderr, "%s\n", to_line(result.error()).c_str());
    std::exit(1);
  }
  return std::move(*result);
}

inline void need(const Result<void>& result) {
  if (result) return;
  std::fprintf(stderr, "%s\n", to_line(result.error()).c_str());
  std::exit(1);
}

/// Processor seconds of all threads of the process, the rasteriser's included: others on the machine disturb
/// them less.
inline double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

}  // namespace selvedge::bench
