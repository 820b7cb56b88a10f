// What every program of ours begins and ends with.
#pragma once

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <variant>

#include "format/base/atomic_file.h"
#include "format/base/error.h"

namespace selvedge {

/// The command of a line that leaves nothing to do: help, version, or a usage error. All has been said.
struct ExitNow {
  int status = 0;  ///< 0 after help or version, 2 after a usage error
};

inline int run(const ExitNow& exit) { return exit.status; }

/// A line on standard error, and 1, where something for standard output could not be written; else `status`.
inline int check_output(const char* name, int status) {
  // Whatever fits into the buffer is written here.
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return status;
  const Error error{Code::file_unwritable, "standard output", "", std::strerror(errno)};
  std::fprintf(stderr, "%s: %s\n", name, to_line(error).c_str());
  return 1;
}

/// Parses the command line into a variant of commands, runs the one that comes out (by its `run`), and gives
/// back its exit status; 1 where standard output could not be written. Unfinished files go when a signal ends
/// the program. Errors are values everywhere; the only exceptions that arrive here are such as running out of
/// memory: one line, status 1.
template <class Parse>
int run_program(const char* name, const Parse& parse, int argc, const char* const* argv) {
  remove_unfinished_files_on_signal();
  try {
    return check_output(name,
                        std::visit([](const auto& command) { return run(command); }, parse(argc, argv)));
  } catch (const std::exception& error) {
    // Texts that do not fit into the buffer are found here.
    if (std::ferror(stdout) != 0) return check_output(name, 1);
    std::fprintf(stderr, "%s: %s\n", name, error.what());
    return 1;
  }
}

}  // namespace selvedge
