#include "converter/dress/fallback.h"

#include <algorithm>
#include <numbers>

#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/fabric/evaluate.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/names.h"

namespace selvedge {

using namespace names::gltf;

namespace {

bool occurs(const Json& json, const std::string& key) {
  if (json.is_object() && json.contains(key)) return true;
  return json.is_structured() &&
         std::ranges::any_of(json, [&](const Json& child) { return occurs(child, key); });
}

constexpr int largest_side = 1024;
constexpr int yarn_side = 64;  ///< of the pictures of a fabric with yarn, unless level 0 has more texels
constexpr int lights_of_integral = 16;

/// Albedo along the normal and opacity of one repeat: of the yarn itself where the fabric has it, whose
/// levels are coarse, else of the texels of `level`.
Image base_picture(const Fabric& fabric, int level) {
  const FabricLevel& source = fabric.levels[level];
  const Yarns* const yarns = level == 0 ? source.yarns().get() : nullptr;
  const int finer = yarns != nullptr ? std::max(1, yarn_side / std::max(source.width, source.height)) : 1;
  Image image{source.width * finer, source.height * finer, 4, {}};
  image.pixels.resize(4 * source.texels() * finer * finer);
  const std::vector<V3f> lights = cell_directions(nearly_square_grid(lights_of_integral));
  double cosines = 0;  // a white Lambertian surface reflects all light
  for (const V3f& light : lights) cosines += light.z;
  const V3f up(0, 0, 1);
  parallel_for(0, image.height, [&](int y) {
    for (int x = 0; x < image.width; ++x) {
      const V2d uv((x + 0.5) / image.width, (y + 0.5) / image.height);
      const auto seen = [&](const V3f& light) {
        return yarns != nullptr ? yarns->shade(uv, fabric.reference_height, light, up)
                                : evaluate(fabric, level, uv, light, up);
      };
      V3d sum(0, 0, 0);
      for (const V3f& light : lights) sum += V3d(seen(light).radiance);
      const V3f albedo(sum * (std::numbers::pi / cosines));
      float* pixel = image.pixels.data() + (y * image.width + x) * 4;
      std::copy_n(&albedo.x, 3, pixel);
      pixel[3] = seen(up).alpha;
    }
  });
  return image;
}

}  // namespace

int find_or_add(Json& root, const char* array, const Json& entry) {
  Json& entries = root[array];
  const auto equal = std::ranges::find(entries, entry);
  return equal != entries.end() ? static_cast<int>(equal - entries.begin()) : append(entries, entry);
}

int find_or_add_image(GltfDocument& document, const std::vector<std::uint8_t>& bytes, const char* label) {
  const Json& images = array_member(document.json, "images");
  for (std::size_t i = 0; i < images.size(); ++i) {
    const auto present = catch_failure(
        [&] { return GltfReader(document).view_bytes(index_of(member(images[i], "bufferView")), ""); });
    if (present && std::ranges::equal(*present, bytes)) return static_cast<int>(i);
  }
  const int view = append_view(document, bytes);
  return append(document.json["images"], {{"name", label}, {"mimeType", "image/png"}, {"bufferView", view}});
}

V3f mean_color(const Image& image) {
  V3d sum(0, 0, 0);
  double weight = 0;
  const std::size_t channels = image.channels;
  for (std::size_t i = 0; i + channels <= image.pixels.size(); i += channels) {
    const double alpha = channels == 4 ? image.pixels[i + 3] : 1.0;
    sum += V3d(image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]) * alpha;
    weight += alpha;
  }
  return weight > 0 ? V3f(sum / weight) : V3f(0, 0, 0);
}

Fallback bake_fallback(const Fabric& cloth) {
  int level = 0;
  while (level + 1 < static_cast<int>(cloth.levels.size()) &&
         std::max(cloth.levels[level].width, cloth.levels[level].height) > largest_side)
    ++level;
  Fallback fallback{base_picture(cloth, level), has_holes(cloth, level), fallback_of(cloth)};
  std::vector<float>& pixels = fallback.color.pixels;
  const V3f present = mean_color(fallback.color);
  for (std::size_t i = 0; i < pixels.size(); ++i)
    if (const int c = static_cast<int>(i % 4); c < 3 && present[c] > 0)
      pixels[i] = std::clamp(pixels[i] * (fallback.factors.base_color[c] / present[c]), 0.0F, 1.0F);
  // Holes have the mean colour.
  const V3f mean = mean_color(fallback.color);
  for (std::size_t i = 0; i < pixels.size(); i += 4)
    if (!(pixels[i + 3] > 0)) std::copy_n(&mean.x, 3, &pixels[i]);
  return fallback;
}

Result<int> add_fallback_texture(GltfDocument& document, const Fallback& fallback) {
  // Without holes alpha is only noise of the view table, and a picture without it is smaller.
  Image base = fallback.color;
  if (!fallback.has_holes) {
    base.channels = 3;
    std::size_t i = 0;
    std::erase_if(base.pixels, [&](float) { return i++ % 4 == 3; });
  }
  return add_color_texture(document, base, "fabric base colour");
}

Result<int> add_color_texture(GltfDocument& document, const Image& image, const char* title) {
  const auto png = encode_png(image, Transfer::srgb);
  if (!png) return tl::unexpected<Error>(png.error());
  const int sampler =
      find_or_add(document.json, "samplers",
                  Json{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 10497}, {"wrapT", 10497}});
  const int source = find_or_add_image(document, *png, title);
  return find_or_add(document.json, "textures", Json{{"sampler", sampler}, {"source", source}});
}

std::vector<std::string> drop_lobes(GltfDocument& document, Json& material, bool unfit_alone) {
  std::vector<std::string> dropped;
  if (!member(material, "extensions").is_object()) return dropped;
  for (const auto& [key, value] : material["extensions"].items()) {
    const bool is_lobe = key.starts_with("KHR_materials_") && key != "KHR_materials_emissive_strength";
    if (unfit_alone ? key == "KHR_materials_unlit" || key == names::gltf::specular_glossiness : is_lobe)
      dropped.push_back(key);
  }
  for (const std::string& key : dropped) material["extensions"].erase(key);
  if (material["extensions"].empty()) material.erase("extensions");
  for (const std::string& key : dropped)
    if (!occurs(document.json, key)) unlist_extension(document.json, key.c_str());
  return dropped;
}

void set_fallback(GltfDocument& document, int material, const Fallback& fallback, int texture,
                  const FabricReference& reference) {
  const auto part = [&](const char* member) -> const Json& {
    return fabric_extension_member(document, material, member);
  };
  Json& json = document.json["materials"][material];
  drop_lobes(document, json);
  Json& core = json["pbrMetallicRoughness"];
  for (const char* key : {"baseColorFactor", "metallicRoughnessTexture"})
    if (core.contains(key)) core.erase(key);
  V3f tint(1, 1, 1);
  for (std::size_t c = 0; c < 3 && part(tint_factor).is_array() && c < part(tint_factor).size(); ++c)
    tint[static_cast<int>(c)] = static_cast<float>(number_or(part(tint_factor)[c], 1));
  const bool masked = part(mask_texture).is_object();
  const char* const own = part(tint_texture).is_object() ? tint_texture : mask_texture;
  const bool has_own = part(own).is_object();
  const V3f factor = has_own ? mean_color(fallback.color) * tint : tint;
  const auto at_most_one = [](const V3f& x) {
    return Json::array({std::min(x.x, 1.0F), std::min(x.y, 1.0F), std::min(x.z, 1.0F)});
  };
  if (factor != V3f(1, 1, 1)) {
    core["baseColorFactor"] = at_most_one(factor);
    core["baseColorFactor"].push_back(1);
  }
  core["baseColorTexture"] =
      has_own ? part(own) : texture_info(texture, reference.tex_coord, reference.transform);
  core["metallicFactor"] = 0;
  core["roughnessFactor"] = 1;
  for (const char* key : {"normalTexture", "alphaMode", "alphaCutoff"}) json.erase(key);
  if (part(normal_texture).is_object()) json["normalTexture"] = part(normal_texture);
  if (fallback.has_holes || masked) {
    json["alphaMode"] = "MASK";
    // The alpha of a tint does not belong to the cloth.
    json["alphaCutoff"] = masked ? number_or(part(mask_cutoff), 0.5) : has_own ? 0.0 : 0.5;
  }
  const auto add_lobe = [&](const char* extension, const Json& lobe) {
    json["extensions"][extension] = lobe;
    list_extension(document.json, extension);
  };
  add_lobe("KHR_materials_specular", {{"specularFactor", 0}});
  const FallbackFactors& factors = fallback.factors;
  if (factors.transmission > 0)
    add_lobe("KHR_materials_diffuse_transmission",
             {{"diffuseTransmissionFactor", factors.transmission},
              {"diffuseTransmissionColorFactor", at_most_one(factors.transmission_color * tint)}});
  const V3f color = factors.sheen_color * tint;
  if (color == V3f(0, 0, 0)) return;
  add_lobe("KHR_materials_sheen",
           {{"sheenColorFactor", at_most_one(color)}, {"sheenRoughnessFactor", factors.sheen_roughness}});
}

}  // namespace selvedge
