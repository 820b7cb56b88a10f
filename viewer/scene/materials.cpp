#include "viewer/scene/materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

namespace selvedge {
namespace {

/// Cache of decoded pictures; colour and data of one file are two pictures.
using Decoded = std::map<std::pair<int, Transfer>, int>;

/// Index into `materials.images` of a decoded picture, or -1.
int decode(const Scene& scene, int index, Transfer transfer, Decoded& decoded, Materials& materials,
           std::vector<std::string>& remarks) {
  if (index < 0) return -1;
  const auto [entry, fresh] = decoded.try_emplace({index, transfer}, -1);
  if (!fresh) return entry->second;
  if (static_cast<std::size_t>(index) >= scene.images.size()) {
    remarks.push_back(fmt::format("{}: image {} does not exist; drawn without it", scene.file, index));
    return -1;
  }
  const SceneImage& encoded = scene.images[index];
  Result<Image> image = decode_image(encoded.bytes, encoded.name, transfer);
  if (!image) {
    remarks.push_back(to_line(image.error()) + "; drawn without it");
    return -1;
  }
  if (image->width > index_pass_side_limit || image->height > index_pass_side_limit) {
    remarks.push_back(
        fmt::format("{}: {} x {} is too large; drawn without it", encoded.name, image->width, image->height));
    return -1;
  }
  entry->second = static_cast<int>(materials.images.size());
  materials.images.push_back(std::move(*image));
  return entry->second;
}

}  // namespace

Result<Materials> materials_of(const Scene& scene, const std::vector<Surface>& surfaces, std::size_t fabrics,
                               std::vector<std::string>& remarks) {
  Materials result;
  Decoded decoded;
  for (const Surface& surface : surfaces) {
    SurfaceMaterial drawn;
    PbrMaterial pbr;
    const bool exists =
        surface.material >= 0 && static_cast<std::size_t>(surface.material) < scene.materials.size();
    // The default material of glTF: white, opaque, single-sided.
    const SceneMaterial material = exists ? scene.materials[surface.material] : SceneMaterial{};
    const Mappings mappings = mappings_of(material);
    const auto texture = [&](const TextureReference& t, Transfer transfer) {
      const int image = decode(scene, t.image, transfer, decoded, result, remarks);
      const int mapping = t.image < 0 ? 0 : mappings.number_of(mapping_of(t));
      return MaterialTexture{image, std::max(mapping, 0), t.wrap_u, t.wrap_v, t.nearest};
    };
    pbr.occlusion = texture(material.occlusion_texture, Transfer::keep);
    pbr.occlusion_strength = material.occlusion_strength;
    pbr.emissive = material.emissive;
    pbr.emissive_texture = texture(material.emissive_texture, Transfer::srgb);
    if (material.fabric) {
      drawn.fabric = material.fabric->fabric;
      if (drawn.fabric < 0 || static_cast<std::size_t>(drawn.fabric) >= fabrics) {
        return fail(Code::gltf_reference, scene.file, fmt::format("material \"{}\"", material.name),
                    fmt::format("fabric {} does not exist", drawn.fabric));
      }
      drawn.keeps_opacity = material.alpha_mode != AlphaMode::opaque;
    } else {
      drawn.base_color = material.base_color;
      pbr.base_color = texture(material.base_color_texture, Transfer::srgb);
      pbr.metallic = material.metallic;
      pbr.roughness = material.roughness;
      pbr.metallic_roughness = texture(material.metallic_roughness_texture, Transfer::keep);
      pbr.normal = texture(material.normal_texture, Transfer::keep);
      pbr.normal_scale = material.normal_scale;
      pbr.unlit = material.unlit;
      drawn.keeps_opacity = material.alpha_mode == AlphaMode::blend;
      if (material.alpha_mode == AlphaMode::mask) drawn.opaque_from = material.alpha_cutoff;
    }
    drawn.culls_back = !material.double_sided;
    result.surfaces.push_back(drawn);
    result.pbr.push_back(pbr);
  }
  return result;
}

}  // namespace selvedge
