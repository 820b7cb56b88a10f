// selvedge-samples: the garment of the demo, made from nothing.
#include <fmt/core.h>

#include <cstdio>
#include <span>
#include <string>

#include "format/base/atomic_file.h"
#include "samples/sweater.h"

namespace {

constexpr const char* help =
    "Makes the garment of the demo: a plain glTF file, ready to be dressed.\n"
    "Usage: selvedge-samples sweater -o FILE.glb\n\n"
    "  sweater            a knitted sweater, materials \"sweater\" and \"trim\"\n"
    "  -o, --output FILE  the GLB file to write\n"
    "  --help, --version\n\n"
    "One unit of TEXCOORD_0 is one metre of cloth.\n"
    "Exit status: 0 good, 1 the file cannot be written, 2 wrong usage.\n"
    "Example: selvedge-samples sweater -o sweater.glb\n";

int run(std::span<char*> words) {
  const std::string first = words.size() > 1 ? words[1] : "";
  if (first == "--help" || first == "-h" || first == "--version") {
    fmt::print("{}", first == "--version" ? "selvedge-samples " SELVEDGE_VERSION "\n" : help);
    return 0;
  }
  const std::string option = words.size() == 4 ? words[2] : "";
  if (first != "sweater" || (option != "-o" && option != "--output")) {
    fmt::print(stderr, "selvedge-samples: wrong usage; see selvedge-samples --help\n");
    return 2;
  }
  const std::string output = words[3];
  const auto garment = selvedge::samples::garment_of(selvedge::samples::make_sweater(), first);
  const auto written = selvedge::write_garment(output, garment);
  if (written) return 0;
  fmt::print(stderr, "selvedge-samples: {}\n", selvedge::to_line(written.error()));
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  selvedge::remove_unfinished_files_on_signal();
  return run({argv, static_cast<std::size_t>(argc)});
}
