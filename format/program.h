// What every program of ours begins and ends with.
#pragma once

#include <cstdio>
#include <exception>
#include <variant>

#include "format/atomic_file.h"

namespace selvedge {

/// The command of a line that leaves nothing to do: help, version, or a usage error. All has been said.
struct ExitNow {
  int status = 0;  ///< 0 after help or version, 2 after a usage error
};

inline int run(const ExitNow& exit) { return exit.status; }

/// Parses the command line into a variant of commands, runs the one that comes out (by its `run`), and gives
/// back its exit status. Unfinished files go when a signal ends the program. Errors are values everywhere;
/// the only exceptions that arrive here are such as running out of memory: one line, status 1.
template <class Parse>
int run_program(const char* name, const Parse& parse, int argc, const char* const* argv) {
  remove_unfinished_files_on_signal();
  try {
    return std::visit([](const auto& command) { return run(command); }, parse(argc, argv));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 1;
  }
}

}  // namespace selvedge
