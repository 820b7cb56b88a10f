#include "format/gltf/materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "format/gltf/access.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/names.h"
#include "format/gltf/uri.h"
#include "format/picture/picture_type.h"

namespace selvedge {
namespace {

float float_of(const Json& value, double otherwise) {
  return static_cast<float>(number_or(value, otherwise));
}

template <class V>
void read_factor(const Json& json, V& factor) {
  for (std::size_t c = 0; json.is_array() && c < V::dimensions() && c < json.size(); ++c)
    factor[static_cast<int>(c)] = float_of(json[c], factor[static_cast<int>(c)]);
}

Wrap wrap_of(const Json& value) {
  constexpr int clamp_to_edge = 33071;
  constexpr int mirrored_repeat = 33648;
  if (value == clamp_to_edge) return Wrap::clamp;
  return value == mirrored_repeat ? Wrap::mirror : Wrap::repeat;
}

constexpr const char* remedy = "which is not read: gltf-transform (png, ktxdecompress) makes PNG of it";

class Reader {
 public:
  Reader(const GltfDocument& document, std::uint64_t image_bytes, Scene& scene)
      : document_(document), image_bytes_(image_bytes), scene_(scene) {}

  SceneMaterial read(const Json& json, std::size_t number, Issues& faults) {
    place_ = fmt::format("/materials/{}", number);
    name_ = string_of(member(json, "name"));
    faults_ = &faults;
    SceneMaterial material;
    material.name = name_;
    read_core(json, material);
    const Json& normal = member(json, "normalTexture");
    material.normal_texture = read_texture(json, "normalTexture");
    material.normal_scale = float_of(member(normal, "scale"), 1);
    const Json& occlusion = member(json, "occlusionTexture");
    material.occlusion_texture = read_texture(json, "occlusionTexture");
    material.occlusion_strength = float_of(member(occlusion, "strength"), 1);
    read_factor(member(json, "emissiveFactor"), material.emissive);
    material.emissive_texture = read_texture(json, "emissiveTexture");
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
    material.garment_textures = read_kept(member(extensions, names::gltf::fabric_extension));
    return material;
  }

 private:
  /// Base colour, metal and roughness. Specular-glossiness has a diffuse colour in their place.
  void read_core(const Json& json, SceneMaterial& material) {
    using names::gltf::specular_glossiness;
    if (const Json& old = member(member(json, "extensions"), specular_glossiness); old.is_object()) {
      read_factor(member(old, "diffuseFactor"), material.base_color);
      const std::string within = fmt::format("/extensions/{}", specular_glossiness);
      material.base_color_texture = read_texture(old, "diffuseTexture", within);
      material.metallic = 0;
      material.roughness = 1 - float_of(member(old, "glossinessFactor"), 1);
      add_remark(scene_,
                 fmt::format("{}{}: only diffuse colour and glossinessFactor are read", place_, within));
      return;
    }
    const Json& pbr = member(json, "pbrMetallicRoughness");
    const std::string within = "/pbrMetallicRoughness";
    read_factor(member(pbr, "baseColorFactor"), material.base_color);
    material.base_color_texture = read_texture(pbr, "baseColorTexture", within);
    material.metallic = float_of(member(pbr, "metallicFactor"), 1);
    material.roughness = float_of(member(pbr, "roughnessFactor"), 1);
    material.metallic_roughness_texture = read_texture(pbr, "metallicRoughnessTexture", within);
  }

  GarmentTextures read_kept(const Json& extension) {
    using namespace names::gltf;
    const std::string within = fmt::format("/extensions/{}", fabric_extension);
    GarmentTextures kept;
    kept.mask = read_texture(extension, mask_texture, within);
    kept.mask_cutoff = float_of(member(extension, mask_cutoff), 0.5);
    kept.normal = read_texture(extension, normal_texture, within);
    kept.normal_scale = float_of(member(member(extension, normal_texture), scale), 1);
    read_factor(member(extension, tint_factor), kept.tint);
    for (int c = 0; c < 3; ++c) kept.tint[c] = std::clamp(kept.tint[c], 0.0F, static_cast<float>(max_tint));
    kept.tint_texture = read_texture(extension, tint_texture, within);
    return kept;
  }

  /// The texture that a member of the material, or of an object in it, refers to.
  TextureReference read_texture(const Json& owner, const char* name, const std::string& within = "") {
    const Json& info = member(owner, name);
    TextureReference texture;
    if (info.is_null()) return texture;
    const auto [set, transform] = read_texture_mapping(info);
    texture.tex_coord = set;
    texture.transform = transform;
    if (const std::optional<TransformFault> fault = transform_range_fault(texture.transform))
      faults_->push_back({Code::gltf_malformed, document_.file,
                          fmt::format("{}{}/{}/extensions/{}/{}", place_, within, name,
                                      names::gltf::texture_transform, fault->member),
                          fault->reason});
    const int number = index_of(member(info, "index"));
    const Json& json = root_entry(document_, "textures", number);
    if (json.is_null()) {
      add_remark(scene_, fmt::format("there is no /textures/{}", number));
      return texture;
    }
    constexpr int nearest = 9728;
    const Json& sampler = root_entry(document_, "samplers", index_of(member(json, "sampler")));
    texture.wrap_u = wrap_of(member(sampler, "wrapS"));
    texture.wrap_v = wrap_of(member(sampler, "wrapT"));
    texture.has_nearest_filter = member(sampler, "magFilter") == nearest;
    const Json& core = member(json, "source");
    const Json& webp = member(member(member(json, "extensions"), names::gltf::texture_webp), "source");
    if (core.is_null() && webp.is_null()) {
      const std::string format = unsupported_texture_format(json);
      add_remark(scene_, fmt::format("{}{}/{} of \"{}\" is {}, {}", place_, within, name, name_,
                                     format.empty() ? "of an unknown format" : format, remedy));
      return texture;
    }
    texture.image = add_image(index_of(core.is_null() ? webp : core));
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
      const std::string_view type = picture_type(image.bytes);
      if (type == "image/ktx2" || type == "image/avif")
        add_remark(scene_, fmt::format("/images/{} is {}, {}", index, type, remedy));
      result = static_cast<int>(scene_.images.size());
      scene_.images.push_back(std::move(image));
    } else {
      add_remark(scene_, fmt::format("/images/{}: {}", index, bytes.error().message));
    }
    images_[index] = result;
    return result;
  }

  const GltfDocument& document_;
  std::uint64_t image_bytes_;
  Scene& scene_;
  Issues* faults_ = nullptr;
  std::string place_;  ///< of the material
  std::string name_;
  std::map<int, int> images_;
};

}  // namespace

const Json& base_texture_of(const Json& material) {
  const Json& old = member(member(material, "extensions"), names::gltf::specular_glossiness);
  return old.is_object() ? member(old, "diffuseTexture")
                         : member(member(material, "pbrMetallicRoughness"), "baseColorTexture");
}

std::string unsupported_texture_format(const Json& texture) {
  for (const auto& [extension, format] :
       {std::pair("KHR_texture_basisu", "KTX2"), {"EXT_texture_avif", "AVIF"}, {"MSFT_texture_dds", "DDS"}})
    if (!member(member(texture, "extensions"), extension).is_null()) return format;
  return "";
}

void read_materials(const GltfDocument& document, std::uint64_t image_bytes, std::uint64_t memory,
                    Scene& scene, IssueSink& issues) {
  const int fabrics = fabric_count(document);
  std::uint64_t room = memory;
  for (int i = 0; i < fabrics; ++i) {
    // Entries may share a view, of which each gets a copy.
    Result<SceneFabric> fabric = room > 0 ? read_fabric_entry(document, i) : SceneFabric();
    if (fabric) room -= std::min<std::uint64_t>(room, fabric->bytes.size());
    if (!fabric) issues.add(fabric.error());
    scene.fabrics.push_back(fabric ? std::move(*fabric) : SceneFabric());
  }
  Reader reader(document, image_bytes, scene);
  const Json& materials = array_member(document.json, "materials");
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const auto reference = read_fabric_reference(document, static_cast<int>(i), fabrics);
    if (!reference) issues.add(reference.error());
    // The fallback of a fabric has its transform, and would repeat its fault.
    Issues faults;
    SceneMaterial material = reader.read(materials[i], i, faults);
    if (reference) issues.add(faults);
    if (reference) material.fabric = *reference;
    scene.materials.push_back(std::move(material));
  }
}

void add_remark(Scene& scene, std::string text) {
  constexpr std::size_t max_remarks = 100;
  if (scene.remarks.size() >= max_remarks) return;
  if (std::ranges::find(scene.remarks, text) == scene.remarks.end()) scene.remarks.push_back(std::move(text));
}

MaterialUses find_material_uses(const Json& json) {
  MaterialUses uses;
  const Json& meshes = array_member(json, "meshes");
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const Json& primitives = array_member(meshes[m], "primitives");
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const Json& primitive = primitives[p];
      const Json& mode = member(primitive, "mode");
      if (!mode.is_null() && index_of(mode) < 4) continue;  // points and lines
      const PrimitiveIndex place(static_cast<int>(m), static_cast<int>(p));
      uses[index_of(member(primitive, "material"))].insert(place);
      const Json& variants = member(member(primitive, "extensions"), names::gltf::variants);
      for (const Json& mapping : array_member(variants, "mappings"))
        uses[index_of(member(mapping, "material"))].insert(place);
    }
  }
  return uses;
}

Result<void> check_uvs(const GltfDocument& document, const std::set<PrimitiveIndex>& places, int tex_coord) {
  for (const auto& [mesh, primitive] : places) {
    const Json& json = document.json["meshes"][mesh]["primitives"][primitive];
    const std::string semantic = fmt::format("TEXCOORD_{}", tex_coord);
    if (member(member(json, "attributes"), semantic.c_str()).is_null())
      return fail(Code::garment_no_uvs, document.file,
                  fmt::format("/meshes/{}/primitives/{}/attributes", mesh, primitive), "no " + semantic);
  }
  return {};
}

}  // namespace selvedge
