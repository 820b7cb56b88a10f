#include "format/program.h"
#include "viewer/commands.h"

namespace {

struct Run {
  int operator()(const selvedge::ExitNow& exit) const { return exit.status; }
  int operator()(const auto& command) const { return selvedge::run(command); }
};

}  // namespace

int main(int argc, char** argv) {
  return selvedge::run_program(
      "selvedge-view", [&] { return selvedge::parse_command_line(argc, argv); }, Run{});
}
