// selvedge-samples: the garments of the demo, made from nothing.
#include <fmt/core.h>

#include <cstdio>
#include <span>
#include <string>
#include <string_view>

#include "format/base/atomic_file.h"
#include "format/base/error.h"
#include "samples/sweater.h"
#include "samples/tablecloth.h"

namespace {

using selvedge::Result;
using selvedge::samples::Assembly;

constexpr int exit_good = 0;
constexpr int exit_failed = 1;
constexpr int exit_usage = 2;

constexpr std::string_view help_text =
    R"(Makes the garments of the demo: plain glTF files, ready to be dressed.

Usage: selvedge-samples GARMENT -o FILE.glb

Garments:
  sweater       a knitted sweater; materials "sweater" and "trim"
  tablecloth    a cloth over a round table; materials "tablecloth" and "wood"

Options:
  -o, --output FILE   the GLB file to write
  -h, --help          print this text
      --version       print the version

One unit of TEXCOORD_0 is one metre of cloth.
Exit status: 0 good, 1 the file cannot be written, 2 wrong usage.
Example: selvedge-samples sweater -o sweater.glb
)";

struct Command {
  std::string garment;
  std::string output;
};

int complain(const std::string& message) {
  fmt::print(stderr, "selvedge-samples: {} (--help tells more)\n", message);
  return exit_usage;
}

int make(const Command& command) {
  Result<Assembly> assembly = command.garment == "sweater"
                                  ? selvedge::samples::make_sweater()
                                  : Result<Assembly>(selvedge::samples::make_tablecloth());
  Result<void> written;
  if (assembly) {
    written =
        selvedge::write_garment(command.output, selvedge::samples::garment_of(*assembly, command.garment));
  } else {
    written = tl::unexpected(assembly.error());
  }
  if (!written) {
    fmt::print(stderr, "selvedge-samples: {}\n", selvedge::to_line(written.error()));
    return exit_failed;
  }
  return exit_good;
}

int run(std::span<char*> arguments) {
  Command command;
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const std::string_view argument = arguments[i];
    if (argument == "-h" || argument == "--help") {
      fmt::print("{}", help_text);
      return exit_good;
    }
    if (argument == "--version") {
      fmt::print("selvedge-samples {}\n", SELVEDGE_VERSION);
      return exit_good;
    }
    if (argument == "-o" || argument == "--output") {
      if (i + 1 == arguments.size()) return complain(fmt::format("{} wants a file", argument));
      command.output = arguments[++i];
    } else if (argument.starts_with("-")) {
      return complain(fmt::format("unknown option {}", argument));
    } else if (!command.garment.empty()) {
      return complain(fmt::format("one garment at a time, not {} as well", argument));
    } else {
      command.garment = argument;
    }
  }
  if (command.garment.empty()) return complain("which garment?");
  if (command.garment != "sweater" && command.garment != "tablecloth") {
    return complain(fmt::format("no garment is called {}", command.garment));
  }
  if (command.output.empty()) return complain("-o FILE.glb is missing");
  return make(command);
}

}  // namespace

int main(int argc, char** argv) {
  selvedge::remove_unfinished_files_on_signal();
  return run({argv, static_cast<std::size_t>(argc)});
}
