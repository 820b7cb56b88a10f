// expand-garment IN OUT: a glTF file with its geometry uncompressed.
#include <fmt/core.h>

#include "format/gltf/document.h"

int main(int argc, char** argv) {
  using namespace selvedge;
  if (argc != 3) return 2;
  const auto written = load_gltf(argv[1]).and_then([&](GltfDocument document) {
    document.original_encoding = {};
    return save_gltf(std::move(document), argv[2]);
  });
  if (!written) fmt::print(stderr, "{}\n", to_line(written.error()));
  return written ? 0 : 1;
}
