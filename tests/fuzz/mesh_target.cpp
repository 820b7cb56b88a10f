// Bytes -> read_mesh, and the same file as a garment. The first byte chooses the format, the rest is the
// file.
#include <array>
#include <string>

#include "converter/mesh/file.h"
#include "format/gltf/document.h"
#include "format/gltf/read_scene.h"
#include "tests/fuzz/target.h"

using namespace selvedge;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::array<std::string, 2> names{"input.obj", "input.ply"};
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const std::string& name = names[data[0] % names.size()];
  const GltfLimits limits{.file_bytes = 1 << 20, .external_files = ExternalFiles::none};
  const Result<GltfDocument> garment = load_gltf({data + 1, size - 1}, "folder/" + name, limits);
  fuzz::require(!garment || read_scene(*garment).has_value(), "a garment that was read is sound");
  MeshImportOptions options;
  options.period = V2d(1, 1);
  const Result<CellMesh> mesh = read_mesh(bytes, name, options);
  if (!mesh) return 0;
  fuzz::require(validate(*mesh, "input").has_value(), "a mesh that was read is valid");
  fuzz::require(
      mesh->normals.size() == mesh->positions.size() && mesh->albedo.size() == mesh->positions.size(),
      "every vertex has a normal and an albedo");
  return 0;
}
