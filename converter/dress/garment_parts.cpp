#include "converter/dress/garment_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "converter/dress/colourways.h"
#include "converter/dress/fabric_source.h"
#include "format/base/guard.h"
#include "format/gltf/access.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/materials.h"
#include "format/gltf/names.h"
#include "format/picture/image.h"

namespace selvedge {

using namespace names::gltf;

namespace {

/// Bytes for a pixel that is decoded and encoded again.
constexpr std::uint64_t pixel_price = 32;

constexpr const char* vertex_color = "COLOR_0";

/// Base colours that programs write where a garment has none of its own: glTF's and Blender's.
constexpr std::array<float, 2> default_greys{1, 0.8F};

/// The name of the picture of a material's base colour in messages. Precondition: there is one.
std::string picture_name(const Scene& scene, const SceneMaterial& material) {
  const int picture = material.base_color_texture.image;
  const std::string& given = scene.images[picture].name;
  return given.empty() ? fmt::format("#{}", picture) : std::filesystem::path(given).filename().string();
}

struct Keeper {
  GltfDocument& document;
  const Scene& scene;
  const SceneMaterial& material;
  const std::set<Place>& places;
  MaskTextures& masks;
  const KeepOptions& options;
  V3f albedo;
  Json& json;
  KeptParts parts = {};
  std::optional<bool> base_fitted = {};

  KeptParts keep() {
    const Json& extension = member(member(json, "extensions"), fabric_extension);
    if (extension.is_object()) {
      for (const char* part : {mask_texture, normal_texture, tint_texture}) {
        if (extension.contains(part)) parts.kept.emplace_back(part);
      }
    } else {
      keep_base_color();
      keep_mask();
      keep_normals();
      name_replaced();
      for (const char* part : {"occlusionTexture", "emissiveTexture"}) {
        if (json.contains(part)) parts.kept.emplace_back(part);
      }
    }
    if (options.color) set_tint(tint_towards(*options.color, albedo));
    if (options.tint) set_tint(*options.tint);
    return std::move(parts);
  }

  Json& own() { return json["extensions"][fabric_extension]; }

  const Json& base_info() const { return base_texture_of(json); }

  void set_tint(const V3f& tint) { own()[tint_factor] = {tint.x, tint.y, tint.z}; }

  bool replaces_color() const { return !options.base_color || options.color || options.tint; }

  void keep_base_color() {
    const V3f color(material.base_color.x, material.base_color.y, material.base_color.z);
    const bool textured = material.base_color_texture.image >= 0;
    const bool vertex_colors = has_vertex_colors();
    if (replaces_color()) {
      if (vertex_colors) {
        parts.replaced.emplace_back(vertex_color);
        drop_vertex_colors();
      }
      if (textured)
        parts.replaced.push_back(fmt::format("baseColorTexture \"{}\"", picture_name(scene, material)));
      if (color != V3f(1, 1, 1))
        parts.replaced.push_back(
            fmt::format("baseColorFactor {:.3g} {:.3g} {:.3g}", color.x, color.y, color.z));
      return;
    }
    const bool colored = std::ranges::none_of(default_greys, [&](float grey) { return color == V3f(grey); });
    const bool printed = textured && base_fits();
    if (!printed && !vertex_colors && (textured || !colored)) return;
    set_tint(tint_towards(color, albedo));
    if (printed || !vertex_colors) parts.kept.emplace_back(printed ? tint_texture : tint_factor);
    if (vertex_colors) parts.kept.emplace_back(vertex_color);
    if (printed) own()[tint_texture] = Json(base_info());
  }

  /// Whether the places have vertex colours other than white.
  bool has_vertex_colors() const {
    return std::ranges::any_of(scene.primitives, [&](const ScenePrimitive& p) {
      return places.contains(Place(p.mesh, p.index)) &&
             std::ranges::any_of(p.colors, [](const V4f& c) { return V3f(c.x, c.y, c.z) != V3f(1); });
    });
  }

  void drop_vertex_colors() {
    for (const Place& place : places) {
      Json& worn = primitive_at(document, place);
      worn["attributes"].erase(vertex_color);
      if (!worn.contains("targets")) continue;
      for (Json& target : worn["targets"]) target.erase(vertex_color);
    }
  }

  /// Whether the texture can be a member of the extension; if not, there is a warning.
  bool fits(const Json& info, const char* what) {
    const int set = placement_of(info).tex_coord;
    std::string why;
    if (entry_of(document, "textures", index_of(member(info, index))).is_null())
      why = "is no texture of the file";
    else if (set > 1)
      why = fmt::format("is on TEXCOORD_{}, and only the sets 0 and 1 are read", set);
    else if (!check_uvs(document, places, set))
      why = fmt::format("is on TEXCOORD_{}, which triangles of the material lack", set);
    if (!why.empty()) parts.warnings.push_back(fmt::format("{} {}: it is left out", what, why));
    return why.empty();
  }

  bool base_fits() {
    if (!base_fitted) base_fitted = fits(base_info(), base_color_texture);
    return *base_fitted;
  }

  void keep_mask() {
    const int picture = material.base_color_texture.image;
    const bool blend = material.alpha_mode == AlphaMode::blend;
    const float opacity = material.base_color.w;
    if (blend && picture < 0) parts.replaced.push_back(fmt::format("alphaMode BLEND of {:.3g}", opacity));
    if (material.alpha_mode == AlphaMode::opaque || picture < 0 || !(opacity > 0)) return;
    const float cutoff = blend ? 0.5F : material.alpha_cutoff / opacity;
    const SceneImage& encoded = scene.images[picture];
    const auto pixels = std::min<std::uint64_t>(scene.memory_left / pixel_price, 1U << 28U);
    const Result<Image> image = decode_image(encoded.bytes, encoded.name, Transfer::keep,
                                             {.pixels = static_cast<std::int64_t>(pixels)});
    if (!image) {
      parts.warnings.push_back(to_line(image.error()) + "; the mask is lost");
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
    parts.kept.emplace_back(mask_texture);
    if (blend)
      parts.replaced.emplace_back("alphaMode BLEND: it is cut where the picture's alpha is below 0.5");
  }

  /// The base colour texture with another picture.
  Json alone(const Image& alpha) {
    Json info = base_info();
    const int base = index_of(member(info, index));
    if (const auto known = masks.find(base); known != masks.end()) {
      info[index] = known->second;
      return info;
    }
    Json texture = document.json["textures"][base];
    const int view = append_view(document, value_or_throw(encode_png(alpha, Transfer::keep)));
    const int image =
        append(document.json["images"], {{name, "mask"}, {mime_type, "image/png"}, {buffer_view, view}});
    texture["source"] = image;
    texture.erase("extensions");
    masks[base] = append(document.json["textures"], texture);
    info[index] = masks[base];
    return info;
  }

  void keep_normals() {
    if (!json.contains(normal_texture) || !fits(json[normal_texture], normal_texture)) return;
    const Json info = json[normal_texture];
    own()[normal_texture] = info;
    parts.kept.emplace_back(normal_texture);
  }

  void name_replaced() {
    if (member(json, "pbrMetallicRoughness").contains("metallicRoughnessTexture"))
      parts.replaced.emplace_back("metallicRoughnessTexture");
    const Json& extensions = member(json, "extensions");
    for (auto it = extensions.begin(); extensions.is_object() && it != extensions.end(); ++it) {
      if (it.key().starts_with("KHR_materials_") && it.key() != "KHR_materials_emissive_strength")
        parts.replaced.push_back(it.key());
    }
  }
};

}  // namespace

Result<KeptParts> keep_parts(GltfDocument& document, int material, const Scene& scene,
                             const std::set<Place>& places, MaskTextures& masks, const KeepOptions& options,
                             const V3f& albedo) {
  return result_of([&] {
    Json& json = document.json["materials"][material];
    return Keeper{document, scene, scene.materials[material], places, masks, options, albedo, json}.keep();
  });
}

}  // namespace selvedge
