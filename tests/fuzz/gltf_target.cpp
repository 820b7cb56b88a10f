// Bytes -> check_gltf, load_gltf (Draco and meshopt included), read_scene. No other file is opened.
#include <algorithm>

#include "format/check/gltf.h"
#include "format/gltf/read_scene.h"
#include "tests/fuzz/target.h"

using namespace selvedge;

namespace {

void check_scene(const Scene& scene) {
  for (const ScenePrimitive& primitive : scene.primitives) {
    const std::size_t vertices = primitive.positions.size();
    fuzz::require(primitive.indices.size() % 3 == 0, "triangles have three corners");
    fuzz::require(std::all_of(primitive.indices.begin(), primitive.indices.end(),
                              [&](std::uint32_t i) { return i < vertices; }),
                  "indices are below the number of vertices");
    fuzz::require(primitive.normals.size() == vertices, "every vertex has a normal");
    fuzz::require(primitive.material < static_cast<int>(scene.materials.size()), "materials exist");
  }
  for (const SceneInstance& instance : scene.instances)
    fuzz::require(
        instance.primitive >= 0 && static_cast<std::size_t>(instance.primitive) < scene.primitives.size(),
        "instances are of primitives that exist");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const SceneLimits limits{
      .document = {.file_bytes = 1 << 20, .nesting = 64, .external_files = ExternalFiles::none}};
  const std::span<const std::uint8_t> bytes(data, size);
  const bool good = !has_error(check_gltf(bytes, "folder/input.gltf", limits));
  const Result<GltfDocument> document = load_gltf(bytes, "folder/input.gltf", limits.document);
  fuzz::require(document.has_value() || !good, "what the checker lets pass is loaded");
  if (!document) return 0;
  const Result<Scene> scene = read_scene(*document);
  fuzz::require(scene.has_value() || !good, "what the checker lets pass is read");
  if (scene) check_scene(*scene);
  return 0;
}
