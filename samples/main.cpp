// selvedge-samples: the garment of the demo, made from nothing.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "format/base/atomic_file.h"
#include "samples/sweater.h"

namespace {

constexpr int exit_failed = 1;
constexpr int exit_usage = 2;

int run(int argc, char** argv) {
  CLI::App app("Makes the garment of the demo: a plain glTF file, ready to be dressed.", "selvedge-samples");
  std::string name;
  std::string output;
  app.add_option("GARMENT", name, "sweater: a knitted sweater, materials \"sweater\" and \"trim\"")
      ->required()
      ->check(CLI::IsMember({"sweater"}));
  app.add_option("-o,--output", output, "the GLB file to write")->required();
  app.set_version_flag("--version", "selvedge-samples " SELVEDGE_VERSION);
  app.footer(
      "One unit of TEXCOORD_0 is one metre of cloth.\n"
      "Exit status: 0 good, 1 the file cannot be written, 2 wrong usage.\n"
      "Example: selvedge-samples sweater -o sweater.glb");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : exit_usage;
  }
  const auto garment = selvedge::samples::garment_of(selvedge::samples::make_sweater(), name);
  const auto written = selvedge::write_garment(output, garment);
  if (written) return 0;
  fmt::print(stderr, "selvedge-samples: {}\n", selvedge::to_line(written.error()));
  return exit_failed;
}

}  // namespace

int main(int argc, char** argv) {
  selvedge::remove_unfinished_files_on_signal();
  return run(argc, argv);
}
