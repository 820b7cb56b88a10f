#include "converter/dress/garment_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "converter/dress/colourways.h"
#include "format/base/guard.h"
#include "format/gltf/access.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/names.h"
#include "format/picture/image.h"

namespace selvedge {

using namespace names::gltf;

namespace {

/// Bytes for a pixel that is decoded and encoded again.
constexpr std::uint64_t pixel_price = 32;

/// Base colours that programs write where a garment has none of its own: glTF's and Blender's.
constexpr std::array<float, 2> default_greys{1, 0.8F};

/// The name of the picture of a material's base colour in messages. Precondition: there is one.
std::string picture_name(const Scene& scene, const SceneMaterial& material) {
  const int picture = material.base_color_texture.image;
  const std::string& given = scene.images[picture].name;
  return given.empty() ? fmt::format("#{}", picture) : std::filesystem::path(given).filename().string();
}

class Keeper {
 public:
  Keeper(GltfDocument& document, int number, const Scene& scene, const std::set<Place>& places,
         MaskTextures& masks, const KeepOptions& options, const V3f& albedo)
      : document_(document),
        scene_(scene),
        material_(scene.materials[number]),
        places_(places),
        masks_(masks),
        options_(options),
        albedo_(albedo),
        json_(document.json["materials"][number]) {}

  KeptParts keep() {
    const Json& extension = member(member(json_, "extensions"), fabric_extension);
    if (extension.is_object()) {
      for (const char* part : {mask_texture, normal_texture, tint_texture}) {
        if (extension.contains(part)) parts_.kept.emplace_back(part);
      }
    } else {
      keep_base_color();
      keep_mask();
      keep_normals();
      name_replaced();
      for (const char* part : {"occlusionTexture", "emissiveTexture"}) {
        if (json_.contains(part)) parts_.kept.emplace_back(part);
      }
    }
    if (options_.color) set_tint(tint_towards(*options_.color, albedo_));
    if (options_.tint) set_tint(*options_.tint);
    return std::move(parts_);
  }

 private:
  Json& own() { return json_["extensions"][fabric_extension]; }

  const Json& base_info() const { return member(member(json_, "pbrMetallicRoughness"), base_color_texture); }

  void set_tint(const V3f& tint) { own()[tint_factor] = {tint.x, tint.y, tint.z}; }

  bool replaces_color() const { return !options_.base_color || options_.color || options_.tint; }

  void keep_base_color() {
    const V3f color(material_.base_color.x, material_.base_color.y, material_.base_color.z);
    const bool textured = material_.base_color_texture.image >= 0;
    if (replaces_color()) {
      if (textured)
        parts_.replaced.push_back(fmt::format("baseColorTexture \"{}\"", picture_name(scene_, material_)));
      if (color != V3f(1, 1, 1))
        parts_.replaced.push_back(
            fmt::format("baseColorFactor {:.3g} {:.3g} {:.3g}", color.x, color.y, color.z));
      return;
    }
    const bool colored = std::ranges::none_of(default_greys, [&](float grey) { return color == V3f(grey); });
    if (textured ? !base_fits() : !colored) return;
    set_tint(tint_towards(color, albedo_));
    parts_.kept.emplace_back(textured ? tint_texture : tint_factor);
    if (textured) own()[tint_texture] = Json(base_info());
  }

  /// Whether the texture can be a member of the extension; if not, there is a warning.
  bool fits(const Json& info, const char* what) {
    const int set = placement_of(info).tex_coord;
    std::string why;
    if (entry_of(document_, "textures", index_of(member(info, index))).is_null()) {
      why = "is no texture of the file";
    } else if (set > 1) {
      why = fmt::format("is on TEXCOORD_{}, and only the sets 0 and 1 are read", set);
    } else if (!check_uvs(document_, places_, set)) {
      why = fmt::format("is on TEXCOORD_{}, which triangles of the material lack", set);
    }
    if (!why.empty()) parts_.warnings.push_back(fmt::format("{} {}: it is left out", what, why));
    return why.empty();
  }

  bool base_fits() {
    if (!base_fits_) base_fits_ = fits(base_info(), base_color_texture);
    return *base_fits_;
  }

  void keep_mask() {
    const int picture = material_.base_color_texture.image;
    const bool blend = material_.alpha_mode == AlphaMode::blend;
    const float opacity = material_.base_color.w;
    if (blend && picture < 0) parts_.replaced.push_back(fmt::format("alphaMode BLEND of {:.3g}", opacity));
    if (material_.alpha_mode == AlphaMode::opaque || picture < 0 || !(opacity > 0)) return;
    const float cutoff = blend ? 0.5F : material_.alpha_cutoff / opacity;
    const SceneImage& encoded = scene_.images[picture];
    const auto pixels = std::min<std::uint64_t>(scene_.memory_left / pixel_price, 1U << 28U);
    const Result<Image> image = decode_image(encoded.bytes, encoded.name, Transfer::keep,
                                             {.pixels = static_cast<std::int64_t>(pixels)});
    if (!image) {
      parts_.warnings.push_back(to_line(image.error()) + "; the mask is lost");
      return;
    }
    Image alpha{image->width, image->height, 2, {}};
    alpha.pixels.reserve(image->pixels.size() / 2);
    bool cuts = false;
    for (std::size_t i = 3; i < image->pixels.size(); i += 4) {
      alpha.pixels.insert(alpha.pixels.end(), {1, image->pixels[i]});
      cuts |= image->pixels[i] < cutoff;
    }
    if (!cuts || !base_fits()) return;
    const Json info = replaces_color() ? alone(alpha) : base_info();
    own()[mask_texture] = info;
    if (cutoff != 0.5F) own()[mask_cutoff] = cutoff;
    parts_.kept.emplace_back(mask_texture);
    if (blend)
      parts_.replaced.emplace_back("alphaMode BLEND: it is cut where the picture's alpha is below 0.5");
  }

  /// The base colour texture with another picture.
  Json alone(const Image& alpha) {
    Json info = base_info();
    const int base = index_of(member(info, index));
    if (const auto known = masks_.find(base); known != masks_.end()) {
      info[index] = known->second;
      return info;
    }
    Json texture = document_.json["textures"][base];
    const int view = append_view(document_, value_or_throw(encode_png(alpha, Transfer::keep)));
    const int image =
        append(document_.json["images"], {{name, "mask"}, {mime_type, "image/png"}, {buffer_view, view}});
    texture["source"] = image;
    texture.erase("extensions");
    masks_[base] = append(document_.json["textures"], texture);
    info[index] = masks_[base];
    return info;
  }

  void keep_normals() {
    if (!json_.contains(normal_texture) || !fits(json_[normal_texture], normal_texture)) return;
    const Json info = json_[normal_texture];
    own()[normal_texture] = info;
    parts_.kept.emplace_back(normal_texture);
  }

  void name_replaced() {
    if (member(json_, "pbrMetallicRoughness").contains("metallicRoughnessTexture"))
      parts_.replaced.emplace_back("metallicRoughnessTexture");
    const Json& extensions = member(json_, "extensions");
    for (auto it = extensions.begin(); extensions.is_object() && it != extensions.end(); ++it) {
      if (it.key().starts_with("KHR_materials_") && it.key() != "KHR_materials_emissive_strength")
        parts_.replaced.push_back(it.key());
    }
  }

  GltfDocument& document_;
  const Scene& scene_;
  const SceneMaterial& material_;
  const std::set<Place>& places_;
  MaskTextures& masks_;
  const KeepOptions& options_;
  V3f albedo_;
  Json& json_;
  KeptParts parts_;
  std::optional<bool> base_fits_;
};

}  // namespace

Result<KeptParts> keep_parts(GltfDocument& document, int material, const Scene& scene,
                             const std::set<Place>& places, MaskTextures& masks, const KeepOptions& options,
                             const V3f& albedo) {
  return result_of([&] { return Keeper(document, material, scene, places, masks, options, albedo).keep(); });
}

}  // namespace selvedge
