#include "converter/dress/garment_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "converter/dress/colourways.h"
#include "converter/dress/fabric_source.h"
#include "converter/dress/fallback.h"
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

/// The name of the picture of a material's base colour in messages; "" of one that was not read.
std::string picture_name(const Scene& scene, const SceneMaterial& material) {
  const int picture = material.base_color_texture.image;
  if (picture < 0) return "";
  const std::string& given = scene.images[picture].name;
  return given.empty() ? fmt::format("#{}", picture) : std::filesystem::path(given).filename().string();
}

double wrapped(double x, Wrap wrap) {
  if (wrap == Wrap::repeat) return x - std::floor(x);
  return wrap == Wrap::clamp ? std::clamp(x, 0.0, 1.0) : std::abs(x - 2 * std::round(x / 2));
}

float alpha_of(const Image& picture, const TextureReference& texture, const V2d& uv) {
  const V2d at_picture = texture.transform.apply(uv);
  const auto pixel = [](double x, int size) { return std::clamp(static_cast<int>(x * size), 0, size - 1); };
  const int x = pixel(wrapped(at_picture.x, texture.wrap_u), picture.width);
  const int y = pixel(wrapped(at_picture.y, texture.wrap_v), picture.height);
  return picture.pixels[4 * (static_cast<std::size_t>(y) * picture.width + x) + 3];
}

/// Integrals over the area of a material of the alpha of its picture and its vertices.
struct AlphaSums {
  double alpha = 0;
  double square = 0;
  double kept = 0;  ///< of alpha where the picture's is not cut
};

struct Keeper {
  GltfDocument& document;
  const Scene& scene;
  const SceneMaterial& material;
  const std::set<PrimitiveIndex>& places;
  const ColorOptions& options;
  V3f albedo;
  Json& json;
  KeptMaterialMembers parts = {};
  std::optional<bool> base_fitted = {};

  KeptMaterialMembers keep() {
    const Json& extension = member(member(json, "extensions"), fabric_extension);
    if (extension.is_object()) {
      for (const char* part : {mask_texture, normal_texture, tint_texture})
        if (extension.contains(part)) parts.kept.emplace_back(part);
    } else {
      keep_base_color();
      keep_mask();
      if (json.contains(normal_texture) && fits(json[normal_texture], normal_texture)) {
        own()[normal_texture] = Json(json[normal_texture]);
        parts.kept.emplace_back(normal_texture);
      }
      name_replaced();
      for (const char* part : {"occlusionTexture", "emissiveTexture"})
        if (json.contains(part)) parts.kept.emplace_back(part);
    }
    if (options.color) set_tint(tint_for_color(*options.color, albedo));
    if (options.tint) set_tint(*options.tint);
    return std::move(parts);
  }

  Json& own() { return json["extensions"][fabric_extension]; }

  const Json& base_info() const { return base_texture_of(json); }

  /// Whether the base colour has a picture in a format that we do not read: the fallback keeps it.
  bool only_others_read() const {
    return !unsupported_texture_format(root_entry(document, "textures", index_of(member(base_info(), index))))
                .empty();
  }

  void set_tint(const V3f& tint) { own()[tint_factor] = {tint.x, tint.y, tint.z}; }

  bool replaces_color() const { return !options.keeps_base_color || options.color || options.tint; }

  void keep_base_color() {
    const V3f color(material.base_color.x, material.base_color.y, material.base_color.z);
    const bool textured = material.base_color_texture.image >= 0 || only_others_read();
    const bool vertex_colors = has_vertex_colors();
    if (replaces_color()) {
      if (vertex_colors) {
        parts.replaced.emplace_back(vertex_color);
        for (const PrimitiveIndex& place : places)
          drop_attribute(primitive_at(document, place), vertex_color);
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
    set_tint(tint_for_color(color, albedo));
    if (printed || !vertex_colors) parts.kept.emplace_back(printed ? tint_texture : tint_factor);
    if (vertex_colors) parts.kept.emplace_back(vertex_color);
    if (printed) own()[tint_texture] = Json(base_info());
  }

  /// Whether the places have vertex colours other than white.
  bool has_vertex_colors() const {
    return std::ranges::any_of(scene.primitives, [&](const ScenePrimitive& p) {
      return places.contains(PrimitiveIndex(p.mesh, p.primitive_index)) &&
             std::ranges::any_of(p.colors, [](const V4f& c) { return V3f(c.x, c.y, c.z) != V3f(1); });
    });
  }

  /// Whether the texture can be a member of the extension; if not, there is a warning.
  bool fits(const Json& info, const char* what) {
    const int set = read_texture_mapping(info).tex_coord;
    std::string why;
    if (root_entry(document, "textures", index_of(member(info, index))).is_null())
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

  AlphaSums sum_alpha(const Image& picture, float cutoff) const {
    constexpr std::size_t samples = 4096;  // of a primitive, one of a triangle at least
    const TextureReference& texture = material.base_color_texture;
    AlphaSums sums;
    for (const ScenePrimitive& p : scene.primitives) {
      if (!places.contains(PrimitiveIndex(p.mesh, p.primitive_index))) continue;
      const std::vector<V2d>& uvs = p.tex_coords[texture.tex_coord == 1 ? 1 : 0];
      const std::size_t count = 1 + samples / (1 + p.indices.size() / 3);
      for (std::size_t i = 0; i < p.indices.size() / 3 * count; ++i) {
        // Points of the sequence R2 (Roberts 2018), folded into the triangle.
        double b = std::fmod(0.5 + 0.7548776662 * static_cast<double>(i), 1);
        double c = std::fmod(0.5 + 0.5698402910 * static_cast<double>(i), 1);
        if (b + c > 1) b = 1 - b, c = 1 - c;
        const std::uint32_t* const corner = &p.indices[3 * (i / count)];
        const auto mix = [&](const auto& value) {
          return value(corner[0]) * (1 - b - c) + value(corner[1]) * b + value(corner[2]) * c;
        };
        const auto point = [&](int k) { return V3d(p.positions[corner[k]]); };
        const double area = (point(1) - point(0)).cross(point(2) - point(0)).length();
        const float pictured =
            uvs.empty() ? 1 : alpha_of(picture, texture, mix([&](auto k) { return uvs[k]; }));
        const double alpha =
            pictured * (p.colors.empty() ? 1 : mix([&](auto k) { return double{p.colors[k].w}; }));
        sums.alpha += area * alpha;
        sums.square += area * alpha * alpha;
        if (pictured >= cutoff) sums.kept += area * alpha;
      }
    }
    return sums;
  }

  /// Cloth is cut where its picture is transparent, but not where that is nearly all over: it is sheer.
  void keep_mask() {
    constexpr double min_kept = 0.2;
    constexpr double opaque = 0.9;
    const bool blend = material.alpha_mode == AlphaMode::blend;
    const float opacity = material.base_color.w;
    const int picture = material.base_color_texture.image;
    const bool textured = picture >= 0 || only_others_read();
    if (material.alpha_mode == AlphaMode::opaque || (textured && !base_fits())) return;
    Image image{1, 1, 4, {1, 1, 1, 1}};
    if (picture >= 0) {
      const auto pixels = std::min<std::uint64_t>(scene.memory_left / pixel_price, 1U << 28U);
      const SceneImage& encoded = scene.images[picture];
      Result<Image> decoded = decode_image(encoded.bytes, encoded.name, Transfer::keep,
                                           {.pixels = static_cast<std::int64_t>(pixels)});
      if (!decoded) {
        parts.warnings.push_back(to_line(decoded.error()) + "; the mask is lost");
        return;
      }
      image = std::move(*decoded);
    }
    const float cutoff = blend ? 0.5F : material.alpha_cutoff / std::max(opacity, 1e-6F);
    const AlphaSums sums = sum_alpha(image, cutoff);
    const bool sheer = sums.kept <= min_kept * sums.alpha;
    const double alpha = sums.alpha > 0 ? opacity * sums.square / sums.alpha : 0;
    if (sheer || (blend && alpha < opaque))
      parts.warnings.push_back(fmt::format("its alpha of {:.2g} is not kept: the cloth is opaque", alpha));
    Image mask{image.width, image.height, 2, {}};
    bool cuts = picture < 0 && textured && !blend;
    for (std::size_t i = 3; i < image.pixels.size(); i += 4) {
      mask.pixels.insert(mask.pixels.end(), {1, image.pixels[i]});
      cuts |= image.pixels[i] < cutoff && !sheer;
    }
    if (blend)
      parts.replaced.push_back(cuts ? "alphaMode BLEND: it is cut where the picture's alpha is below 0.5"
                                    : fmt::format("alphaMode BLEND of {:.3g}", alpha));
    if (!cuts) return;
    own()[mask_texture] = replaces_color() ? alone(mask) : base_info();
    if (cutoff != 0.5F) own()[mask_cutoff] = cutoff;
    parts.kept.emplace_back(mask_texture);
  }

  /// The base colour texture with another picture.
  Json alone(const Image& alpha) {
    Json info = base_info();
    Json texture = document.json["textures"][index_of(member(info, index))];
    texture["source"] =
        find_or_add_image(document, value_or_throw(encode_png(alpha, Transfer::keep)), "mask");
    texture.erase("extensions");
    info[index] = find_or_add(document.json, "textures", texture);
    return info;
  }

  void name_replaced() {
    if (member(json, "pbrMetallicRoughness").contains("metallicRoughnessTexture"))
      parts.replaced.emplace_back("metallicRoughnessTexture");
    const Json& extensions = member(json, "extensions");
    for (auto it = extensions.begin(); extensions.is_object() && it != extensions.end(); ++it)
      if (it.key().starts_with("KHR_materials_") && it.key() != "KHR_materials_emissive_strength")
        parts.replaced.push_back(it.key());
  }
};

}  // namespace

Result<KeptMaterialMembers> keep_material_members(GltfDocument& document, int material, const Scene& scene,
                                                  const std::set<PrimitiveIndex>& places,
                                                  const ColorOptions& options, const V3f& albedo) {
  return catch_failure([&] {
    Json& json = document.json["materials"][material];
    return Keeper{document, scene, scene.materials[material], places, options, albedo, json}.keep();
  });
}

}  // namespace selvedge
