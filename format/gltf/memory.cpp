#include "format/gltf/memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "format/gltf/picture_type.h"

namespace selvedge {
namespace {

/// The pictures that drawing decodes, each once for colours and once for data (viewer/scene/materials.cpp).
std::set<std::pair<int, bool>> drawn_pictures(const Scene& scene) {
  std::set<std::pair<int, bool>> drawn;
  const auto add = [&](const TextureReference& texture, bool colour) {
    if (texture.image >= 0 && static_cast<std::size_t>(texture.image) < scene.images.size())
      drawn.emplace(texture.image, colour);
  };
  for (const SceneMaterial& material : scene.materials) {
    add(material.occlusion_texture, false);
    add(material.emissive_texture, true);
    // Drawn without a fabric, and compared with it by the checker.
    add(material.base_color_texture, true);
    if (material.fabric) continue;
    add(material.metallic_roughness_texture, false);
    add(material.normal_texture, false);
  }
  return drawn;
}

}  // namespace

Result<MemoryAccount> check_drawable(const Scene& scene, std::uint64_t limit) {
  MemoryAccount account(limit);
  const auto refuse = [&](const std::string& what) {
    return tl::unexpected<Error>(beyond_memory(scene.file, "", what, limit));
  };
  for (const ScenePrimitive& primitive : scene.primitives) {
    if (!account.take(primitive.positions.size(), memory_price::vertex) ||
        !account.take(primitive.indices.size(), memory_price::index))
      return refuse("its primitives");
  }
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& primitive = scene.primitives[instance.primitive];
    if (!account.take(1, memory_price::instance) ||
        !account.take(primitive.positions.size(), memory_price::placed_vertex) ||
        !account.take(primitive.indices.size() / 3, memory_price::placed_triangle))
      return refuse("its instances");
  }
  std::uint64_t pixels = 0;
  std::uint64_t largest = 0;
  std::uint64_t encoded = 0;
  // Decoding copies what is needed of a picture.
  for (const SceneImage& image : scene.images) encoded += image.bytes.size();
  const auto drawn = drawn_pictures(scene);
  for (const auto& [image, colour] : drawn) {
    const std::uint64_t size = picture_pixels(scene.images[image].bytes);
    pixels += std::min(size, limit);  // so that the sum of a few thousand pictures is no wrapped number
    largest = std::max(largest, size);
  }
  if (!account.take(encoded, 2) || !account.take(pixels, memory_price::pixel) ||
      !account.take(largest, memory_price::decoding))
    return refuse(fmt::format("{} decoded pictures", drawn.size()));
  return account;
}

}  // namespace selvedge
