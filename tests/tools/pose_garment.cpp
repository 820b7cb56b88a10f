// pose-garment IN CLIP SECONDS...: the world positions of the corners of all triangles of each instance at
// these times of a clip, as doubles on standard output, behind their number.
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>

#include "format/gltf/clip.h"
#include "format/gltf/read_scene.h"

using namespace selvedge;

int main(int argc, char** argv) {
  const auto good = [](auto result) {
    if (result) return std::move(*result);
    fmt::print(stderr, "{}\n", to_line(result.error()));
    std::exit(1);
  };
  auto document = good(load_gltf(argv[1]));
  const Clip clip = good(Clip::read(document, argv[2], default_memory_limit));
  for (int i = 3; i < argc; ++i) {
    clip.pose(std::atof(argv[i]), document);
    const Scene scene = good(read_scene(document));
    std::vector<double> numbers{0};
    for (const SceneInstance& instance : scene.instances) {
      const ScenePrimitive& primitive = scene.primitives[instance.primitive];
      for (const std::uint32_t corner : primitive.indices) {
        const V3d place = V3d(primitive.positions[corner]) * instance.world;
        numbers.insert(numbers.end(), {place.x, place.y, place.z});
      }
    }
    numbers[0] = static_cast<double>(numbers.size() - 1);
    std::fwrite(numbers.data(), sizeof(double), numbers.size(), stdout);
  }
  return 0;
}
