// Dresses every garment of a folder, for garments.mjs to validate, with its own texture coordinates and with
// new ones: dress_garments FOLDER OUTPUT_FOLDER
// Prints "input<tab>output<tab>" per file dressed. A garment that cannot be dressed is written again as it
// is, and the reason printed behind; without an output if it cannot be read either.
#include <cstdio>
#include <filesystem>
#include <set>

#include "converter/dress/dress.h"
#include "format/fabric/file.h"
#include "format/gltf/document.h"
#include "tests/converter/fabrics.h"

namespace fs = std::filesystem;
using namespace selvedge;

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const fs::path output = argv[2];
  fs::create_directories(output);
  const std::string fabric = (output / "net fabric.exr").string();
  if (const auto good = write_fabric(fabric, test::net_fabric()); !good) {
    std::fprintf(stderr, "%s\n", to_line(good.error()).c_str());
    return 1;
  }
  std::set<fs::path> garments;
  for (const auto& entry : fs::recursive_directory_iterator(argv[1])) {
    const std::string ending = entry.path().extension().string();
    if (ending == ".gltf" || ending == ".glb") garments.insert(entry.path());
  }
  int number = 0;
  for (const fs::path& garment : garments) {
    for (const char* ending : {".glb", ".gltf"}) {
      const std::string name = std::to_string(number++) + "-" + garment.stem().string() + ending;
      DressOptions options;
      options.all_cloth = true;
      if (name.ends_with(".gltf")) options.unwrap = Unwrapping::always;
      const auto report = dress(garment.string(), fabric, (output / name).string(), options);
      bool written = report.has_value();
      if (!report) {
        auto document = load_gltf(garment.string());
        if (document) written = save_gltf(std::move(*document), (output / name).string()).has_value();
      }
      std::printf("%s\t%s\t%s\n", garment.string().c_str(), written ? (output / name).string().c_str() : "",
                  report ? "" : to_line(report.error()).c_str());
    }
  }
  return 0;
}
