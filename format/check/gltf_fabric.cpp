#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "format/base/json_text.h"
#include "format/check/fabric.h"
#include "format/check/gltf.h"
#include "format/fabric/evaluate.h"
#include "format/gltf/access.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/materials.h"
#include "format/gltf/names.h"

namespace selvedge {

using namespace names::gltf;

namespace {

/// Two transforms count as equal up to this relative error, which float arithmetic makes.
constexpr double transform_tolerance = 1e-5;

bool close(double a, double b) {
  return std::abs(a - b) <= transform_tolerance * std::max({1.0, std::abs(a), std::abs(b)});
}

bool close(const UvTransform& a, const UvTransform& b) {
  return close(a.offset.x, b.offset.x) && close(a.offset.y, b.offset.y) && close(a.scale.x, b.scale.x) &&
         close(a.scale.y, b.scale.y) && close(a.rotation, b.rotation);
}

/// The fabric of an entry of the root array; empty if it cannot be read.
struct CheckedEntry {
  bool has_holes = false;
  std::optional<V3f> albedo;  ///< the mean, where the file tells it
};
using Entry = std::optional<CheckedEntry>;

/// Visits the textures below a material (objects shaped like a textureInfo), with their place. Extras and the
/// reference to a fabric are left out.
template <class F>
void for_each_texture(const Json& json, const std::string& place, const F& visit) {
  for (const auto& [key, value] : json.items()) {
    if (!value.is_object() || key == "extras" || key == fabric_extension) continue;
    const std::string where = member_pointer(place, key);
    if (key.ends_with("Texture") && value.contains(index))
      visit(value, where);
    else
      for_each_texture(value, where, visit);
  }
}

bool lists(const Json& root, const char* array) {
  const Json& names = array_member(root, array);
  return std::ranges::find(names, fabric_extension) != names.end();
}

/// The rules that readers do not check: faults of entries and references are found by read_materials.
class FabricCheck {
 public:
  FabricCheck(const GltfDocument& document, const Scene& scene, IssueSink& issues)
      : document_(document), root_(document.json), scene_(scene), issues_(issues) {}

  void check() {
    if (lists(root_, "extensionsRequired"))
      wrong("/extensionsRequired", std::string(fabric_extension) + " must not be required");
    const Json& extension = member(member(root_, "extensions"), fabric_extension);
    const Json& materials = array_member(root_, "materials");
    std::vector<int> dressed;
    for (int i = 0; i < static_cast<int>(materials.size()); ++i)
      if (!member(member(materials[i], "extensions"), fabric_extension).is_null()) dressed.push_back(i);
    if (extension.is_null() && dressed.empty()) return;
    if (!lists(root_, "extensionsUsed")) wrong("/extensionsUsed", "does not list the extension");
    const int count = fabric_count(document_);
    if (count == 0)
      wrong(fmt::format("/extensions/{}/{}", fabric_extension, fabrics), "is no list of fabrics");
    for (int i = 0; i < count; ++i) entries_.push_back(check_entry(i));
    for (const int material : dressed) check_material(materials[material], material);
  }

 private:
  void wrong(const std::string& place, std::string message) {
    issues_.add(Code::gltf_extension, place, std::move(message));
  }
  /// Other viewers show something else.
  void warn(const std::string& place, std::string message) {
    issues_.add(Code::gltf_fallback, place, std::move(message));
  }

  const Json& entry(int number) const { return root_["extensions"][fabric_extension][fabrics][number]; }

  Entry check_entry(int number) {
    const Json& json = entry(number);
    const std::string place = fmt::format("/extensions/{}/{}/{}", fabric_extension, fabrics, number);
    const Result<SceneFabric> fabric = read_fabric_entry(document_, number);
    if (!json.is_object()) return {};
    if (member(json, mime_type) != fabric_mime_type)
      wrong(place + "/" + mime_type, fmt::format("has to be \"{}\"", fabric_mime_type));
    if (json.contains(name) && !json[name].is_string()) wrong(place + "/" + name, "is not a string");
    if (!fabric) return {};
    for (const char* forbidden : {"byteStride", "target"})
      if (json.contains(buffer_view) &&
          !member(root_["bufferViews"][index_of(json[buffer_view])], forbidden).is_null())
        wrong(place + "/" + buffer_view, fmt::format("buffer view {} has a {}, which is for vertices",
                                                     index_of(json[buffer_view]), forbidden));
    // Entries may share a file or a view, which is checked once.
    const Json& source = json.contains(uri) ? json[uri] : json[buffer_view];
    const auto [known, fresh] = sources_.try_emplace(source.dump(), entries_.size());
    if (!fresh) return entries_[known->second];
    return check_source(*fabric, place);
  }

  Entry check_source(const SceneFabric& fabric, const std::string& place) {
    std::error_code ignored;
    const bool embedded = fabric.path.empty();
    const bool present = embedded || (document_.external_files != ExternalFiles::none &&
                                      std::filesystem::is_regular_file(fabric.path, ignored));
    if (!present) {
      issues_.add(Code::gltf_reference, place + "/" + uri, fmt::format("there is no file {}", fabric.path));
      return {};
    }
    const FabricLimits limits{.memory = scene_.memory_left};
    CheckedFabric checked =
        embedded ? check_fabric(fabric.bytes, document_.file, limits) : check_fabric(fabric.path, limits);
    for (Error& issue : checked.issues)
      if (embedded) issue.place = issue.place.empty() ? place : place + ": " + issue.place;
    issues_.add(checked.issues);
    if (!checked.fabric) return {};
    CheckedEntry entry{has_holes(*checked.fabric, 0), {}};
    const Json& albedo = Json::parse(checked.fabric->fallback).value("albedo", Json());
    if (albedo.is_array() && albedo.size() == 3)
      entry.albedo = V3f(albedo[0].get<float>(), albedo[1].get<float>(), albedo[2].get<float>());
    return entry;
  }

  void check_material(const Json& material, int number) {
    const std::string place = fmt::format("/materials/{}", number);
    for (const char* other : {"KHR_materials_unlit", "KHR_materials_pbrSpecularGlossiness"})
      if (material["extensions"].contains(other))
        wrong(fmt::format("{}/extensions/{}", place, other), "does not go with a fabric");
    const Json& set = member(member(material["extensions"][fabric_extension], fabric), tex_coord);
    if (!set.is_null() && index_of(set) < 0)
      wrong(fmt::format("{}/extensions/{}/{}/{}", place, fabric_extension, fabric, tex_coord),
            "is not a UV set");
    const std::optional<FabricReference>& reference = scene_.materials[number].fabric;
    if (!reference) return;
    check_parts(material["extensions"][fabric_extension], number, place);
    if (!uses_.contains(number)) issues_.add(Code::gltf_advice, place, "is on no triangles");
    check_coordinates(number, reference->tex_coord, "the fabric");
    each_without("NORMAL", number, [&](const std::string& where) {
      issues_.add(Code::gltf_advice, where, "no NORMAL: the fabric is seen on flat triangles");
    });
    if (member(material, "doubleSided") != true)
      issues_.add(Code::gltf_advice, place + "/doubleSided", "is not true: the cloth's back is not drawn");
    check_fallback(material, place, *reference);
    const Entry& worn = entries_[reference->fabric];
    if (!worn) return;
    check_alpha(material, place, worn->has_holes);
    const V3f& tint = scene_.materials[number].garment_textures.tint;
    if (worn->albedo)
      if (const auto issue =
              unreached_variant("", fmt::format("{}/extensions/{}/{}", place, fabric_extension, tint_factor),
                                *worn->albedo, tint))
        issues_.add(issue->code, issue->place, issue->message);
  }

  /// Calls missing(place) for the primitives of a material without an attribute.
  template <class F>
  void each_without(const std::string& attribute, int number, const F& missing) {
    const auto uses = uses_.find(number);
    if (uses == uses_.end()) return;
    for (const auto& [m, p] : uses->second) {
      const Json& attributes = member(root_["meshes"][m]["primitives"][p], "attributes");
      if (member(attributes, attribute.c_str()).is_null())
        missing(fmt::format("/meshes/{}/primitives/{}/attributes", m, p));
    }
  }

  void check_coordinates(int number, int set, const char* user) {
    const std::string semantic = fmt::format("TEXCOORD_{}", set);
    each_without(semantic, number, [&](const std::string& place) {
      issues_.add(Code::garment_no_uvs, place,
                  fmt::format("no {} for {} of material {}", semantic, user, number));
    });
  }

  /// Parts of the garment: its textures, mask and tint.
  void check_parts(const Json& extension, int number, const std::string& place) {
    const std::string within = fmt::format("{}/extensions/{}/", place, fabric_extension);
    for (const char* part : {mask_texture, normal_texture, tint_texture}) {
      const Json& info = member(extension, part);
      if (info.is_null()) continue;
      if (root_entry(document_, "textures", index_of(member(info, index))).is_null()) {
        wrong(within + part, "is no texture of the file");
        continue;
      }
      check_coordinates(number, read_texture_mapping(info).tex_coord, "the garment's textures");
    }
    const Json& cutoff = member(extension, mask_cutoff);
    if (!cutoff.is_null() && !(number_or(cutoff, -1) >= 0))
      wrong(within + mask_cutoff, "is no number from 0 on");
    const Json& tint = member(extension, tint_factor);
    const bool in_range = tint.is_array() && tint.size() == 3 && std::ranges::all_of(tint, [](const Json& c) {
                            const double value = number_or(c, -1);
                            return value >= 0 && value <= max_tint;
                          });
    if (!tint.is_null() && !in_range)
      wrong(within + tint_factor, fmt::format("has not three numbers from 0 to {}", max_tint));
  }

  static const Json& own(const Json& material, const char* part) {
    return member(material["extensions"][fabric_extension], part);
  }

  /// The picture of the garment that is the fallback's base colour; null if that is the fabric's.
  static const Json& own_base(const Json& material) {
    const Json& tint = own(material, tint_texture);
    return tint.is_null() ? own(material, mask_texture) : tint;
  }

  void check_fallback(const Json& material, const std::string& place, const FabricReference& reference) {
    const Json& core = member(material, "pbrMetallicRoughness");
    const Json& color = member(core, "baseColorTexture");
    if (color.is_null())
      warn(place + "/pbrMetallicRoughness", "no baseColorTexture: other viewers show one colour");
    if (const double metal = number_or(member(core, "metallicFactor"), 1); metal != 0)
      warn(place + "/pbrMetallicRoughness/metallicFactor",
           fmt::format("is {}: other viewers show metal", metal));
    for_each_texture(material, place, [&](const Json& info, const std::string& where) {
      // These two are drawn beside the fabric; they do not belong to the fallback.
      if (where == place + "/emissiveTexture" || where == place + "/occlusionTexture") return;
      const Json& of_garment = where == place + "/pbrMetallicRoughness/baseColorTexture" ? own_base(material)
                               : where == place + "/normalTexture" ? own(material, normal_texture)
                                                                   : Json();
      if (of_garment.is_object()) {
        check_layout(info, where, "the extension's texture", read_texture_mapping(of_garment));
        if (member(info, index) != member(of_garment, index))
          warn(where, "is another texture than the extension's");
        return;
      }
      check_layout(info, where, "the fabric", {reference.tex_coord, reference.transform});
      check_wrap(info, where);
    });
  }

  void check_layout(const Json& info, const std::string& place, const char* other,
                    const TextureMapping& wanted) {
    const auto [set, transform] = read_texture_mapping(info);
    if (set != wanted.tex_coord)
      issues_.add(Code::gltf_transform, place,
                  fmt::format("is on UV set {}, {} on {}", set, other, wanted.tex_coord));
    if (!close(transform, wanted.transform))
      issues_.add(Code::gltf_transform, place,
                  fmt::format("has a scale of {} x {}, {} one of {} x {}, or another offset or rotation",
                              transform.scale.x, transform.scale.y, other, wanted.transform.scale.x,
                              wanted.transform.scale.y));
  }

  void check_wrap(const Json& info, const std::string& place) {
    constexpr int repeat = 10497;
    const Json& texture = root_entry(document_, "textures", index_of(member(info, index)));
    const int number = index_of(member(texture, "sampler"));
    for (const char* axis : {"wrapS", "wrapT"}) {
      const Json& wrap = member(root_entry(document_, "samplers", number), axis);
      if (wrap.is_null() || wrap == repeat) continue;
      warn(place, fmt::format("{} of its sampler {} is {}: it does not repeat as the fabric does", axis,
                              number, number_or(wrap, 0)));
    }
  }

  void check_alpha(const Json& material, const std::string& place, bool holes) {
    const std::string mode = string_of(member(material, "alphaMode"));
    const std::string where = place + "/alphaMode";
    if (holes && mode != "MASK" && mode != "BLEND")
      issues_.add(Code::gltf_alpha, where, "is OPAQUE: the holes of the fabric are not seen");
    if (!holes && mode == "BLEND")
      issues_.add(Code::gltf_alpha, where, "is BLEND, but the fabric has no holes");
    if (holes && mode == "BLEND")
      warn(where, "is BLEND: other viewers draw layers of cloth in a wrong order");
    const bool masked = own(material, mask_texture).is_object();
    if (masked && mode != "MASK")
      warn(where, "is not MASK: other viewers do not show the outline of the garment");
    const double cutoff = number_or(member(material, "alphaCutoff"), 0.5);
    const double wanted = masked ? number_or(own(material, mask_cutoff), 0.5) : 0.5;
    const bool any = !masked && own_base(material).is_object();
    if (mode == "MASK" && !any && !close(cutoff, wanted))
      warn(place + "/alphaCutoff",
           fmt::format("is {}: the fallback's holes are drawn for {}", cutoff, wanted));
  }

  const GltfDocument& document_;
  const Json& root_;
  const Scene& scene_;
  IssueSink& issues_;
  std::vector<Entry> entries_;
  std::map<std::string, std::size_t> sources_;  ///< uri or view -> the first entry that names it
  MaterialUses uses_ = find_material_uses(root_);
};

}  // namespace

void check_fabric_extension(const GltfDocument& document, const Scene& scene, IssueSink& issues) {
  FabricCheck(document, scene, issues).check();
}

}  // namespace selvedge
