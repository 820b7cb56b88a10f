#include "format/gltf/memory.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "format/picture/picture_type.h"

namespace selvedge {
namespace {

/// The pictures that drawing may decode, each once for colours and once for data
/// (viewer/scene/materials.cpp).
std::set<std::pair<int, bool>> drawn_pictures(const Scene& scene) {
  std::set<std::pair<int, bool>> drawn;
  const auto add = [&](const TextureReference& texture, bool colour) {
    if (texture.image >= 0) drawn.emplace(texture.image, colour);
  };
  for (const SceneMaterial& material : scene.materials) {
    add(material.occlusion_texture, false);
    add(material.emissive_texture, true);
    // Drawn without a fabric, and compared with it by the checker.
    add(material.base_color_texture, true);
    add(material.garment_textures.mask, true);
    add(material.garment_textures.tint_texture, true);
    add(material.garment_textures.normal, false);
    if (material.fabric) continue;
    add(material.metallic_roughness_texture, false);
    add(material.normal_texture, false);
  }
  return drawn;
}

}  // namespace

Result<MemoryBudget> check_scene_memory(const Scene& scene, std::uint64_t limit) {
  MemoryBudget budget(limit);
  const auto refuse = [&](const std::string& what) {
    return tl::unexpected<Error>(memory_limit_error(scene.file, "", what, limit));
  };
  for (const ScenePrimitive& primitive : scene.primitives)
    if (!budget.try_spend(primitive.positions.size(), bytes_per_vertex) ||
        !budget.try_spend(primitive.indices.size(), bytes_per_index))
      return refuse("its primitives");
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& primitive = scene.primitives[instance.primitive];
    if (!budget.try_spend(1, bytes_per_instance) ||
        !budget.try_spend(primitive.positions.size(), bytes_per_placed_vertex) ||
        !budget.try_spend(primitive.indices.size() / 3, bytes_per_placed_triangle))
      return refuse("its instances");
  }
  // A picture of one colour has a thousandth of its pixels in bytes, and takes as long as any other.
  std::uint64_t pixels = 0;
  for (const auto& [image, colour] : drawn_pictures(scene)) {
    const std::vector<std::uint8_t>& file = scene.images[image].bytes;
    const std::uint64_t bytes = file.size();
    // PNG's depth: 16 bits take twice as long.
    const std::uint64_t times = bytes > 24 && file[0] == 0x89 && file[24] == 16 ? 2 : 1;
    const std::uint64_t size = std::min(times * picture_pixel_count(file), std::uint64_t{1} << 40);
    pixels += size - std::min(size, bytes * max_pixels_per_encoded_byte);
  }
  if (pixels > max_pixels_above_ratio)
    return fail(Code::file_too_large, scene.file, "",
                fmt::format("its pictures have {} million pixels more than {} a byte", pixels / 1'000'000,
                            max_pixels_per_encoded_byte));
  std::uint64_t encoded = 0;
  for (const SceneImage& image : scene.images) encoded += image.bytes.size();
  // The renderer has its own, and decoding copies what is needed of one.
  if (!budget.try_spend(encoded, 3)) return refuse("its encoded pictures");
  return budget;
}

bool try_spend_textures(MemoryBudget& budget, std::uint64_t texture_pixels,
                        std::uint64_t largest_texture_pixels, std::uint64_t largest_picture_pixels) {
  return budget.try_spend(texture_pixels, bytes_per_texture_pixel) &&
         budget.try_spend(largest_texture_pixels, bytes_per_unfinished_texture_pixel) &&
         budget.try_spend(largest_picture_pixels, bytes_per_decoded_picture_pixel);
}

Result<void> check_texture_memory(const Scene& scene, MemoryBudget budget) {
  std::uint64_t pixels = 0;
  std::uint64_t largest = 0;
  const auto drawn = drawn_pictures(scene);
  for (const auto& [image, colour] : drawn) {
    const std::uint64_t size = picture_pixel_count(scene.images[image].bytes);
    pixels += std::min(size, budget.limit());  // so that the sum of some thousand is no wrapped number
    largest = std::max(largest, size);
  }
  if (try_spend_textures(budget, pixels, largest, largest)) return {};
  return tl::unexpected<Error>(
      memory_limit_error(scene.file, "", fmt::format("{} decoded pictures", drawn.size()), budget.limit()));
}

}  // namespace selvedge
