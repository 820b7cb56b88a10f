#include "format/gltf/materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "format/gltf/access.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/uri.h"

namespace selvedge {
namespace {

float float_of(const Json& value, double otherwise) {
  return static_cast<float>(number_of(value, otherwise));
}

template <class V>
void read_factor(const Json& json, V& factor) {
  for (std::size_t c = 0; json.is_array() && c < V::dimensions() && c < json.size(); ++c) {
    factor[static_cast<int>(c)] = float_of(json[c], factor[static_cast<int>(c)]);
  }
}

Wrap wrap_of(const Json& value) {
  constexpr int clamp_to_edge = 33071;
  constexpr int mirrored_repeat = 33648;
  if (value == clamp_to_edge) return Wrap::clamp;
  return value == mirrored_repeat ? Wrap::mirror : Wrap::repeat;
}

class Reader {
 public:
  Reader(const GltfDocument& document, std::uint64_t image_bytes, Scene& scene)
      : document_(document), image_bytes_(image_bytes), scene_(scene) {}

  SceneMaterial read(const Json& json) {
    SceneMaterial material;
    material.name = string_of(member(json, "name"));
    const Json& pbr = member(json, "pbrMetallicRoughness");
    read_factor(member(pbr, "baseColorFactor"), material.base_color);
    material.base_color_texture = read_texture(member(pbr, "baseColorTexture"));
    material.metallic = float_of(member(pbr, "metallicFactor"), 1);
    material.roughness = float_of(member(pbr, "roughnessFactor"), 1);
    material.metallic_roughness_texture = read_texture(member(pbr, "metallicRoughnessTexture"));
    const Json& normal = member(json, "normalTexture");
    material.normal_texture = read_texture(normal);
    material.normal_scale = float_of(member(normal, "scale"), 1);
    const Json& occlusion = member(json, "occlusionTexture");
    material.occlusion_texture = read_texture(occlusion);
    material.occlusion_strength = float_of(member(occlusion, "strength"), 1);
    read_factor(member(json, "emissiveFactor"), material.emissive);
    material.emissive_texture = read_texture(member(json, "emissiveTexture"));
    const Json& extensions = member(json, "extensions");
    const Json& strength = member(extensions, "KHR_materials_emissive_strength");
    material.emissive *= float_of(member(strength, "emissiveStrength"), 1);
    material.unlit = !member(extensions, "KHR_materials_unlit").is_null();
    const std::string mode = string_of(member(json, "alphaMode"));
    material.alpha_mode = mode == "MASK"    ? AlphaMode::mask
                          : mode == "BLEND" ? AlphaMode::blend
                                            : AlphaMode::opaque;
    material.alpha_cutoff = float_of(member(json, "alphaCutoff"), 0.5);
    material.double_sided = member(json, "doubleSided") == true;
    return material;
  }

 private:
  TextureReference read_texture(const Json& info) {
    TextureReference texture;
    if (info.is_null()) return texture;
    texture.tex_coord = std::max(0, index_of(member(info, "texCoord")));
    texture.transform = read_uv_transform(info, texture.tex_coord);
    const int number = index_of(member(info, "index"));
    const Json& json = entry_of(document_, "textures", number);
    if (json.is_null()) {
      remark(scene_, fmt::format("there is no /textures/{}", number));
      return texture;
    }
    constexpr int nearest = 9728;
    const Json& sampler = entry_of(document_, "samplers", index_of(member(json, "sampler")));
    texture.wrap_u = wrap_of(member(sampler, "wrapS"));
    texture.wrap_v = wrap_of(member(sampler, "wrapT"));
    texture.nearest = member(sampler, "magFilter") == nearest;
    const Json& source = member(json, "source");
    if (source.is_null()) {
      remark(scene_, "a texture without a PNG or JPEG picture is left out");
      return texture;
    }
    texture.image = add_image(index_of(source));
    return texture;
  }

  /// An unreadable picture is remarked; the garment is read without it.
  int add_image(int index) {
    const auto known = images_.find(index);
    if (known != images_.end()) return known->second;
    int result = -1;
    if (auto bytes = read_image_bytes(document_, index, image_bytes_)) {
      const Json& json = document_.json["images"][index];
      SceneImage image{string_of(member(json, "name")), string_of(member(json, "mimeType")), {}};
      const std::string uri = string_of(member(json, "uri"));
      if (image.name.empty() && !uri.starts_with("data:")) image.name = uri;
      image_bytes_ -= bytes->size();
      image.bytes = std::move(*bytes);
      result = static_cast<int>(scene_.images.size());
      scene_.images.push_back(std::move(image));
    } else {
      remark(scene_, fmt::format("/images/{}: {}", index, bytes.error().message));
    }
    images_[index] = result;
    return result;
  }

  const GltfDocument& document_;
  std::uint64_t image_bytes_;
  Scene& scene_;
  std::map<int, int> images_;
};

}  // namespace

void read_materials(const GltfDocument& document, std::uint64_t image_bytes, Scene& scene,
                    IssueSink& issues) {
  const int fabrics = fabric_count(document);
  for (int i = 0; i < fabrics; ++i) {
    Result<SceneFabric> fabric = read_fabric_entry(document, i);
    if (!fabric) issues.add(fabric.error());
    scene.fabrics.push_back(fabric ? std::move(*fabric) : SceneFabric());
  }
  Reader reader(document, image_bytes, scene);
  const Json& materials = array_of(document.json, "materials");
  for (std::size_t i = 0; i < materials.size(); ++i) {
    SceneMaterial material = reader.read(materials[i]);
    const auto reference = read_fabric_reference(document, static_cast<int>(i), fabrics);
    if (!reference) issues.add(reference.error());
    if (reference) material.fabric = *reference;
    scene.materials.push_back(std::move(material));
  }
}

void remark(Scene& scene, std::string text) {
  constexpr std::size_t max_remarks = 100;
  if (scene.remarks.size() >= max_remarks) return;
  if (std::find(scene.remarks.begin(), scene.remarks.end(), text) == scene.remarks.end()) {
    scene.remarks.push_back(std::move(text));
  }
}

}  // namespace selvedge
