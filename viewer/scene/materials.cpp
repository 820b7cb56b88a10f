#include "viewer/scene/materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "format/picture/picture_type.h"

namespace selvedge {
namespace {

using PictureBytes = std::shared_ptr<const std::vector<std::uint8_t>>;

/// Indices into Materials::pictures; colour and data of one file are two pictures.
struct Known {
  std::map<std::pair<int, Transfer>, int> pictures;
  std::map<int, PictureBytes> files;
};

/// Index into `materials.pictures` of a picture of the scene, or -1.
int take_picture(const Scene& scene, int index, Transfer transfer, Known& known, Materials& materials,
                 std::vector<std::string>& remarks) {
  if (index < 0) return -1;
  const auto [entry, fresh] = known.pictures.try_emplace({index, transfer}, -1);
  if (!fresh) return entry->second;
  const SceneImage& encoded = scene.images[index];
  const std::string name = fmt::format("{}: image {}{}", scene.file, index,
                                       encoded.name.empty() ? "" : " \"" + encoded.name + "\"");
  const auto size = picture_size(encoded.bytes);
  if (size.x == 0) {
    const Error error{Code::image_unreadable, name, "", "neither PNG nor JPEG"};
    remarks.push_back(to_line(error) + "; drawn without it");
    return -1;
  }
  if (std::max(size.x, size.y) > max_frame_side) {
    remarks.push_back(fmt::format("{}: {} x {} is too large; drawn without it", name, size.x, size.y));
    return -1;
  }
  PictureBytes& bytes = known.files[index];
  if (!bytes) bytes = std::make_shared<const std::vector<std::uint8_t>>(encoded.bytes);
  entry->second = static_cast<int>(materials.pictures.size());
  materials.pictures.push_back({name, bytes, transfer, V2i(size), 0});
  return entry->second;
}

}  // namespace

bool Materials::needs_pbr() const {
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const SurfaceMaterial& s = surfaces[i];
    if (s.fabric < 0 || s.is_modified() || emits(i) || pbr[i].metallic_roughness_texture.image >= 0)
      return true;
  }
  return false;
}

Materials materials_of(const Scene& scene, const std::vector<Surface>& surfaces,
                       std::vector<std::string>& remarks) {
  Materials result;
  Known known;
  for (const Surface& surface : surfaces) {
    SurfaceMaterial drawn;
    PbrMaterial pbr;
    // The default material of glTF: white, opaque, single-sided.
    const SceneMaterial material =
        surface.material >= 0 ? scene.materials[surface.material] : SceneMaterial{};
    const Mappings mappings = mappings_of(material);
    const auto texture = [&](const TextureReference& t, Transfer transfer) {
      const int image = take_picture(scene, t.image, transfer, known, result, remarks);
      const int mapping = t.image < 0 ? 0 : mappings.index_of(mapping_of(t));
      return MaterialTexture{image, std::max(mapping, 0), t.wrap_u, t.wrap_v, t.has_nearest_filter};
    };
    pbr.occlusion_texture = texture(material.occlusion_texture, Transfer::keep);
    pbr.occlusion_strength = material.occlusion_strength;
    pbr.emissive = material.emissive;
    pbr.emissive_texture = texture(material.emissive_texture, Transfer::srgb);
    if (material.fabric) {
      drawn.fabric = material.fabric->fabric;
      drawn.keeps_opacity = material.alpha_mode != AlphaMode::opaque;
      const GarmentTextures& kept = material.garment_textures;
      drawn.tint = kept.tint;
      pbr.base_color_texture = texture(kept.tint_texture, Transfer::srgb);
      drawn.is_tinted = pbr.base_color_texture.image >= 0 ||
                        std::ranges::any_of(surface.colors,
                                            [](const V4f& c) { return V3f(c.x, c.y, c.z) != V3f(1, 1, 1); });
      // Its alpha equals the alpha of a tint of the same picture.
      pbr.metallic_roughness_texture = texture(kept.mask, Transfer::srgb);
      if (pbr.metallic_roughness_texture.image >= 0) drawn.min_opacity = kept.mask_cutoff;
      pbr.normal_texture = texture(kept.normal, Transfer::keep);
      pbr.normal_scale = kept.normal_scale;
      pbr.normal_frame = mappings.normal_frame;
      drawn.has_normal_texture = pbr.normal_texture.image >= 0;
      drawn.has_occlusion_texture = pbr.occlusion_texture.image >= 0;
    } else {
      drawn.base_color_factor = material.base_color;
      pbr.base_color_texture = texture(material.base_color_texture, Transfer::srgb);
      pbr.metallic = material.metallic;
      pbr.roughness = material.roughness;
      pbr.metallic_roughness_texture = texture(material.metallic_roughness_texture, Transfer::keep);
      pbr.normal_texture = texture(material.normal_texture, Transfer::keep);
      pbr.normal_scale = material.normal_scale;
      pbr.unlit = material.unlit;
      drawn.keeps_opacity = material.alpha_mode == AlphaMode::blend;
      if (material.alpha_mode == AlphaMode::mask) drawn.min_opacity = material.alpha_cutoff;
    }
    drawn.culls_back = !material.double_sided;
    drawn.material = surface.material;
    result.surfaces.push_back(drawn);
    result.pbr.push_back(pbr);
  }
  return result;
}

}  // namespace selvedge
