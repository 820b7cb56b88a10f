// What every program of ours begins and ends with.
#pragma once

#include <cstdio>
#include <exception>
#include <variant>

#include "format/atomic_file.h"

namespace selvedge {

/// Parses the command line into a variant of commands, runs the one that comes out, and gives back its exit
/// status. Unfinished files go when a signal ends the program. Errors are values everywhere; the only
/// exceptions that arrive here are such as running out of memory: one line, status 1.
template <class Parse, class Run>
int run_program(const char* name, const Parse& parse, const Run& run) {
  remove_unfinished_files_on_signal();
  try {
    return std::visit(run, parse());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 1;
  }
}

}  // namespace selvedge
