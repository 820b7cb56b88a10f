#include <fmt/format.h>
#include <exception>

#include "format/atomic_file.h"
#include "viewer/commands.h"

namespace {

struct Run {
  int operator()(const selvedge::ExitNow& exit) const { return exit.status; }
  template <class Command>
  int operator()(const Command& command) const {
    return selvedge::run(command);
  }
};

}  // namespace

int main(int argc, char** argv) {
  selvedge::remove_unfinished_files_on_signal();
  // Errors are values everywhere; what is left is running out of memory.
  try {
    return std::visit(Run{}, selvedge::parse_command_line(argc, argv));
  } catch (const std::exception& e) {
    fmt::print(stderr, "selvedge-view: {}\n", e.what());
    return 1;
  }
}
