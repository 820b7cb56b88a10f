#include "converter/dress/fallback_material.h"

#include <algorithm>

#include "format/base/guard.h"
#include "format/gltf/edit.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/names.h"

namespace selvedge {

using namespace names::gltf;

namespace {

constexpr const char* sheen = "KHR_materials_sheen";
constexpr const char* transmission = "KHR_materials_diffuse_transmission";
constexpr const char* specular = "KHR_materials_specular";

/// Index of an equal entry of a root array; appends the entry if it is new.
int find_or_add(Json& root, const char* array, const Json& entry) {
  Json& entries = root[array];
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (entries[i] == entry) return static_cast<int>(i);
  }
  entries.push_back(entry);
  return static_cast<int>(entries.size()) - 1;
}

int find_or_add_image(GltfDocument& document, const std::vector<std::uint8_t>& bytes, const char* name) {
  const Json& images = member(document.json, "images");
  for (std::size_t i = 0; images.is_array() && i < images.size(); ++i) {
    const auto present =
        result_of([&] { return GltfReader(document).bytes(index_of(member(images[i], "bufferView")), ""); });
    if (present && std::equal(present->begin(), present->end(), bytes.begin(), bytes.end()))
      return static_cast<int>(i);
  }
  const int view = append_view(document, bytes);
  document.json["images"].push_back(Json{{"name", name}, {"mimeType", "image/png"}, {"bufferView", view}});
  return static_cast<int>(document.json["images"].size()) - 1;
}

bool occurs(const Json& json, const std::string& key) {
  if (json.is_object() && json.contains(key)) return true;
  return json.is_structured() &&
         std::ranges::any_of(json, [&](const Json& child) { return occurs(child, key); });
}

/// The fallback replaces every lobe; emission is not a lobe.
void drop_lobes(GltfDocument& document, Json& material) {
  if (!member(material, "extensions").is_object()) return;
  std::vector<std::string> dropped;
  for (const auto& [name, value] : material["extensions"].items()) {
    if (name.starts_with("KHR_materials_") && name != "KHR_materials_emissive_strength")
      dropped.push_back(name);
  }
  for (const std::string& name : dropped) material["extensions"].erase(name);
  if (material["extensions"].empty()) material.erase("extensions");
  for (const std::string& name : dropped) {
    if (!occurs(document.json, name)) drop_extension(document.json, name.c_str());
  }
}

}  // namespace

Result<FallbackTextures> add_fallback_textures(GltfDocument& document, const Fallback& fallback) {
  // Without holes alpha is only noise of the view table, and a picture without it is smaller.
  Image base = fallback.base_color;
  if (!fallback.holes) {
    base.channels = 3;
    std::size_t i = 0;
    std::erase_if(base.pixels, [&](float) { return i++ % 4 == 3; });
  }
  const int sampler =
      find_or_add(document.json, "samplers",
                  Json{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 10497}, {"wrapT", 10497}});
  const auto texture_of = [&](const std::vector<std::uint8_t>& png, const char* image_name) {
    const int source = find_or_add_image(document, png, image_name);
    return find_or_add(document.json, "textures", Json{{"sampler", sampler}, {"source", source}});
  };
  FallbackTextures textures;
  const auto color = encode_png(base, Transfer::srgb);
  if (!color) return tl::unexpected<Error>(color.error());
  textures.base_color = texture_of(*color, "fabric base colour");
  if (fallback.normal) {
    const auto normal = encode_png(*fallback.normal, Transfer::keep);
    if (!normal) return tl::unexpected<Error>(normal.error());
    textures.normal = texture_of(*normal, "fabric normals");
  }
  return textures;
}

void set_fallback(GltfDocument& document, int material, const Fallback& fallback,
                  const FallbackTextures& textures, const FabricReference& reference) {
  const auto part = [&](const char* member) -> const Json& { return part_of(document, material, member); };
  Json& json = document.json["materials"][material];
  drop_lobes(document, json);
  Json& core = json["pbrMetallicRoughness"];
  for (const char* key : {"baseColorFactor", "metallicRoughnessTexture"}) {
    if (core.contains(key)) core.erase(key);
  }
  V3f tint(1, 1, 1);
  for (std::size_t c = 0; c < 3 && part(tint_factor).is_array() && c < part(tint_factor).size(); ++c)
    tint[static_cast<int>(c)] = static_cast<float>(number_of(part(tint_factor)[c], 1));
  const bool masked = part(mask_texture).is_object();
  const char* const own = part(tint_texture).is_object() ? tint_texture : mask_texture;
  const bool has_own = part(own).is_object();
  const V3f factor = has_own ? mean_color(fallback.base_color) * tint : tint;
  const auto most_one = [](const V3f& x) {
    return Json::array({std::min(x.x, 1.0F), std::min(x.y, 1.0F), std::min(x.z, 1.0F)});
  };
  if (factor != V3f(1, 1, 1)) {
    core["baseColorFactor"] = most_one(factor);
    core["baseColorFactor"].push_back(1);
  }
  core["baseColorTexture"] =
      has_own ? part(own) : texture_info(textures.base_color, reference.tex_coord, reference.transform);
  core["metallicFactor"] = 0;
  core["roughnessFactor"] = 1;
  for (const char* key : {"normalTexture", "alphaMode", "alphaCutoff"}) {
    if (json.contains(key)) json.erase(key);
  }
  if (part(normal_texture).is_object()) {
    json["normalTexture"] = part(normal_texture);
  } else if (textures.normal >= 0) {
    json["normalTexture"] = texture_info(textures.normal, reference.tex_coord, reference.transform);
  }
  if (fallback.holes || masked) {
    json["alphaMode"] = "MASK";
    // The alpha of a tint does not belong to the cloth.
    json["alphaCutoff"] = masked ? number_of(part(mask_cutoff), 0.5) : has_own ? 0.0 : 0.5;
  }
  json["extensions"][specular] = {{"specularFactor", 0}};
  use_extension(document.json, specular);
  if (fallback.transmission > 0) {
    json["extensions"][transmission] = {
        {"diffuseTransmissionFactor", fallback.transmission},
        {"diffuseTransmissionColorFactor", most_one(fallback.transmission_color * tint)}};
    use_extension(document.json, transmission);
  }
  const V3f color = fallback.sheen_color * tint;
  if (color == V3f(0, 0, 0)) return;
  json["extensions"][sheen] = {{"sheenColorFactor", most_one(color)},
                               {"sheenRoughnessFactor", fallback.sheen_roughness}};
  use_extension(document.json, sheen);
}

}  // namespace selvedge
