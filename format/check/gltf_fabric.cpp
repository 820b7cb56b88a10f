#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "format/check/fabric.h"
#include "format/check/gltf_parts.h"
#include "format/fabric/file.h"
#include "format/fabric/holes.h"
#include "format/gltf/access.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/names.h"

namespace selvedge {

using namespace names::gltf;

namespace {

const std::string root_place = std::string("/extensions/") + fabric_extension;

/// Of two transforms that were meant to be the same: what float arithmetic makes of them.
constexpr double transform_tolerance = 1e-5;

std::string text_of(const Json& value) {
  return value.is_string() ? value.get<std::string>() : std::string();
}

bool close(double a, double b) {
  return std::abs(a - b) <= transform_tolerance * std::max({1.0, std::abs(a), std::abs(b)});
}

bool close(const UvTransform& a, const UvTransform& b) {
  return close(a.offset.x, b.offset.x) && close(a.offset.y, b.offset.y) && close(a.scale.x, b.scale.x) &&
         close(a.scale.y, b.scale.y) && close(a.rotation, b.rotation);
}

/// What the fabric of an entry of the root array says of the materials that use it.
struct FabricFacts {
  bool holes = false;
  std::string digest;  ///< of its header
};

/// Nothing if the fabric cannot be read.
using Entry = std::optional<FabricFacts>;

class FabricCheck {
 public:
  FabricCheck(const GltfDocument& document, IssueSink& issues)
      : document_(document), root_(document.json), issues_(issues) {}

  void check() {
    const Json& extension = member(member(root_, "extensions"), fabric_extension);
    const Json& materials = member(root_, "materials");
    bool referred = false;
    for (std::size_t i = 0; materials.is_array() && i < materials.size(); ++i) {
      referred = referred || !member(member(materials[i], "extensions"), fabric_extension).is_null();
    }
    const Json& required = member(root_, "extensionsRequired");
    if (required.is_array() &&
        std::find(required.begin(), required.end(), fabric_extension) != required.end()) {
      wrong("/extensionsRequired", std::string(fabric_extension) + " must not be required");
    }
    if (extension.is_null() && !referred) return;
    check_root(extension);
    collect_uses();
    for_each_object(root_, "materials", [&](const Json& material, int index) {
      if (!member(member(material, "extensions"), fabric_extension).is_null())
        check_material(material, index);
    });
  }

 private:
  void wrong(const std::string& place, std::string message) {
    issues_.add(Code::gltf_extension, place, std::move(message));
  }

  void check_root(const Json& extension) {
    const Json& list = member(extension, fabrics);
    const std::string place = root_place + "/" + fabrics;
    if (!list.is_array() || list.empty()) {
      return wrong(place, list.is_null() ? "is missing" : list.is_array() ? "is empty" : "is not an array");
    }
    for (std::size_t i = 0; i < list.size(); ++i) {
      entries_.push_back(check_entry(list[i], fmt::format("{}/{}", place, i)));
    }
  }

  Entry check_entry(const Json& entry, const std::string& place) {
    if (!entry.is_object()) {
      wrong(place, "is not an object");
      return {};
    }
    if (const Json& type = member(entry, mime_type); type != fabric_mime_type) {
      wrong(place + "/" + mime_type, fmt::format("has to be \"{}\"", fabric_mime_type));
    }
    if (entry.contains(name) && !entry[name].is_string()) wrong(place + "/" + name, "is not a string");
    if (entry.contains(uri) == entry.contains(buffer_view)) {
      wrong(place, "needs either a uri or a bufferView");
      return {};
    }
    return entry.contains(uri) ? check_uri(entry[uri], place) : check_view(entry[buffer_view], place);
  }

  Entry check_uri(const Json& value, const std::string& place) {
    if (text_of(value).empty()) {
      wrong(place + "/" + uri, "is not a string, or empty");
      return {};
    }
    const std::string address = value.get<std::string>();
    if (address.starts_with("data:")) {
      const auto bytes = read_uri(document_, address, place + "/" + uri);
      if (bytes) return check_bytes(*bytes, place);
      issues_.add(bytes.error());
      return {};
    }
    const auto path = resolve_uri(document_, address, place + "/" + uri);
    if (!path) {
      issues_.add(path.error());
      return {};
    }
    std::error_code ignored;
    if (!document_.external_files || !std::filesystem::is_regular_file(*path, ignored)) {
      issues_.add(Code::gltf_reference, place + "/" + uri, fmt::format("there is no file {}", *path));
      return {};
    }
    if (const auto known = files_.find(*path); known != files_.end()) return entries_[known->second];
    files_[*path] = entries_.size();
    const Issues found = check_fabric(*path);
    issues_.add(found);
    return has_error(found) ? Entry() : facts_of(FabricReader::open(*path));
  }

  Entry check_view(const Json& value, const std::string& place) {
    const std::string where = place + "/" + buffer_view;
    const int view = index_of(value);
    const Json& views = member(root_, "bufferViews");
    if (view < 0 || !views.is_array() || static_cast<std::size_t>(view) >= views.size()) {
      wrong(where, fmt::format("there is no buffer view {}", excerpt(value)));
      return {};
    }
    if (!member(views[view], "byteStride").is_null()) {
      wrong(where, fmt::format("buffer view {} has a byteStride", view));
    }
    if (!member(views[view], "target").is_null()) {
      wrong(where, fmt::format("buffer view {} has a target, which is for vertices and indices", view));
    }
    const auto bytes = bytes_of_view(document_, view, where);
    if (!bytes) return {};  // reported with the views
    if (const auto known = views_.find(view); known != views_.end()) return entries_[known->second];
    views_[view] = entries_.size();
    return check_bytes(*bytes, place);
  }

  Entry check_bytes(std::span<const std::uint8_t> bytes, const std::string& place) {
    Issues found = check_fabric(bytes, document_.file);
    for (Error& issue : found) {
      issue.file = document_.file;
      issue.place = issue.place.empty() ? place : place + ": " + issue.place;
    }
    issues_.add(found);
    return has_error(found) ? Entry() : facts_of(FabricReader::open(bytes, document_.file));
  }

  static Entry facts_of(Result<FabricReader> reader) {
    if (!reader) return {};
    const auto fabric = reader->read_levels(0, 0, {Layer::opacity, Layer::heights});
    if (!fabric) return {};
    return FabricFacts{has_holes(*fabric, 0), reader->digest()};
  }

  /// Primitives of triangles by material, directly or in a variant.
  void collect_uses() {
    for_each_object(root_, "meshes", [&](const Json& mesh, int m) {
      for_each_object(mesh, "primitives", [&](const Json& primitive, int p) {
        const Json& mode = member(primitive, "mode");
        if (!mode.is_null() && index_of(mode) < 4) return;
        const std::pair place(m, p);
        uses_[index_of(member(primitive, "material"))].insert(place);
        for_each_object(
            member(member(primitive, "extensions"), variants), "mappings",
            [&](const Json& mapping, int) { uses_[index_of(member(mapping, "material"))].insert(place); });
      });
    });
  }

  void check_material(const Json& material, int index) {
    const std::string place = fmt::format("/materials/{}", index);
    const std::string where = fmt::format("{}/extensions/{}/{}", place, fabric_extension, fabric);
    const Json& extensions = material["extensions"];
    for (const char* other : {"KHR_materials_unlit", "KHR_materials_pbrSpecularGlossiness"}) {
      if (extensions.contains(other)) {
        wrong(fmt::format("{}/extensions/{}", place, other), "does not go with a fabric");
      }
    }
    const Json& info = member(extensions[fabric_extension], fabric);
    if (!info.is_object()) return wrong(where, info.is_null() ? "is missing" : "is not an object");
    const Json& set_value = member(info, tex_coord);
    if (!set_value.is_null() && index_of(set_value) < 0) {
      wrong(where + "/" + tex_coord, fmt::format("{} is no UV set", excerpt(set_value)));
    }
    FabricReference reference;
    reference.fabric = index_of(member(info, names::gltf::index));
    reference.tex_coord = std::max(0, index_of(set_value));
    reference.transform = read_uv_transform(info, reference.tex_coord);
    if (const std::optional<TransformFault> fault = fault_of(reference.transform)) {
      wrong(fmt::format("{}/extensions/{}/{}", where, texture_transform, fault->member), fault->reason);
    }
    check_primitives(material, index, reference.tex_coord);
    if (member(material, "doubleSided") != true) {
      issues_.add(Code::gltf_advice, place + "/doubleSided", "is not true: the cloth's back is not drawn");
    }
    if (reference.fabric < 0 || static_cast<std::size_t>(reference.fabric) >= entries_.size()) {
      return wrong(where + "/" + names::gltf::index,
                   fmt::format("there is no fabric {}", excerpt(member(info, names::gltf::index))));
    }
    check_fallback(material, place, reference);
    check_mirror(material, place, reference);
    if (const Entry& facts = entries_[reference.fabric]) {
      check_alpha(material, place, facts->holes);
    }
  }

  void check_primitives(const Json& material, int index, int set) {
    const auto uses = uses_.find(index);
    if (uses == uses_.end()) {
      return issues_.add(Code::gltf_advice, fmt::format("/materials/{}", index), "is on no triangles");
    }
    const std::string semantic = fmt::format("TEXCOORD_{}", set);
    for (const auto& [m, p] : uses->second) {
      const Json& primitive = root_["meshes"][m]["primitives"][p];
      const Json& attributes = member(primitive, "attributes");
      const std::string place = fmt::format("/meshes/{}/primitives/{}/attributes", m, p);
      const auto has = [&](const char* name) { return !member(attributes, name).is_null(); };
      if (!has(semantic.c_str())) {
        issues_.add(Code::garment_no_uvs, place,
                    fmt::format("no {} for the fabric of material {}", semantic, index));
      }
      if (!has("NORMAL")) {
        issues_.add(Code::gltf_advice, place, "no NORMAL: the fabric is seen on flat triangles");
      }
      if (material.contains("normalTexture") && !has("TANGENT")) {
        issues_.add(Code::gltf_advice, place,
                    "no TANGENT for the fallback's normalTexture: viewers make their own");
      }
    }
  }

  void check_fallback(const Json& material, const std::string& place, const FabricReference& reference) {
    const Json& core = member(material, "pbrMetallicRoughness");
    const Json& color = member(core, "baseColorTexture");
    if (color.is_null()) {
      issues_.add(Code::gltf_fallback, place + "/pbrMetallicRoughness",
                  "no baseColorTexture: other viewers show one colour");
    }
    if (const double metal = number_of(member(core, "metallicFactor"), 1); metal != 0) {
      issues_.add(Code::gltf_fallback, place + "/pbrMetallicRoughness/metallicFactor",
                  fmt::format("is {}: other viewers show metal", metal));
    }
    for_each_texture(material, place, [&](const Json& info, const std::string& where) {
      // These two stand beside the fabric, they are no part of the fallback.
      if (where == place + "/emissiveTexture" || where == place + "/occlusionTexture") return;
      check_layout(info, where, reference);
      check_wrap(info, where);
    });
  }

  void check_layout(const Json& info, const std::string& place, const FabricReference& reference) {
    int set = std::max(0, index_of(member(info, tex_coord)));
    const UvTransform transform = read_uv_transform(info, set);
    if (set != reference.tex_coord) {
      issues_.add(Code::gltf_transform, place,
                  fmt::format("is on UV set {}, the fabric on {}", set, reference.tex_coord));
    }
    if (!close(transform, reference.transform)) {
      issues_.add(
          Code::gltf_transform, place,
          fmt::format("has a scale of {} x {}, the fabric one of {} x {}, or another offset or rotation",
                      transform.scale.x, transform.scale.y, reference.transform.scale.x,
                      reference.transform.scale.y));
    }
  }

  void check_wrap(const Json& info, const std::string& place) {
    constexpr int repeat = 10497;
    const auto texture = entry_of(document_, "textures", index_of(member(info, names::gltf::index)), place);
    if (!texture) return;  // named by the schema, as is a sampler that is not there
    const int number = index_of(member(**texture, "sampler"));
    const auto sampler = entry_of(document_, "samplers", number, place);
    if (!sampler) return;
    for (const char* axis : {"wrapS", "wrapT"}) {
      const Json& wrap = member(**sampler, axis);
      if (wrap.is_null() || wrap == repeat) continue;
      issues_.add(Code::gltf_fallback, place,
                  fmt::format("{} of its sampler {} is {}: it does not repeat as the fabric does", axis,
                              number, excerpt(wrap)));
    }
  }

  void check_mirror(const Json& material, const std::string& place, const FabricReference& reference) {
    const std::string where = fmt::format("{}/extras/{}", place, fabric_extension);
    const Json& mirror = member(member(material, "extras"), fabric_extension);
    if (!mirror.is_object()) {
      return issues_.add(Code::gltf_mirror, where,
                         "is missing: tools that drop the extension lose the fabric");
    }
    const auto differs = [&](const std::string& key) {
      issues_.add(Code::gltf_mirror, where + "/" + key, "differs from the extension's");
    };
    if (index_of(member(mirror, names::gltf::index)) != reference.fabric) differs(names::gltf::index);
    int set = std::max(0, index_of(member(mirror, tex_coord)));
    const UvTransform transform = read_uv_transform(mirror, set);
    if (set != reference.tex_coord) differs(tex_coord);
    if (!close(transform, reference.transform)) differs("extensions");
    const auto fabric_index = static_cast<std::size_t>(reference.fabric);
    const Json& entry = root_["extensions"][fabric_extension][fabrics][fabric_index];
    if (mirror.contains(name) && mirror[name] != member(entry, name)) differs(name);
    if (member(mirror, uri) != member(entry, uri) && !text_of(member(entry, uri)).starts_with("data:")) {
      differs(uri);
    }
    const Entry& facts = entries_[fabric_index];
    if (facts && mirror.contains(digest) && mirror[digest] != facts->digest) {
      issues_.add(Code::gltf_mirror, where + "/" + digest, "is that of another fabric");
    }
  }

  void check_alpha(const Json& material, const std::string& place, bool holes) {
    const Json& given = member(material, "alphaMode");
    const std::string mode = given.is_string() ? given.get<std::string>() : "OPAQUE";
    const std::string where = place + "/alphaMode";
    if (holes && mode != "MASK" && mode != "BLEND") {
      issues_.add(Code::gltf_alpha, where, "is OPAQUE: the holes of the fabric are not seen");
    }
    if (!holes && mode == "BLEND")
      issues_.add(Code::gltf_alpha, where, "is BLEND, but the fabric has no holes");
    if (holes && mode == "BLEND") {
      issues_.add(Code::gltf_fallback, where,
                  "is BLEND: other viewers draw layers of cloth in a wrong order");
    }
    const double cutoff = number_of(member(material, "alphaCutoff"), 0.5);
    if (mode == "MASK" && cutoff != 0.5) {
      issues_.add(Code::gltf_fallback, place + "/alphaCutoff",
                  fmt::format("is {}: the fallback's holes are drawn for 0.5", cutoff));
    }
  }

  const GltfDocument& document_;
  const Json& root_;
  IssueSink& issues_;
  std::vector<Entry> entries_;
  std::map<std::string, std::size_t> files_;  ///< path -> the first entry that names it
  std::map<int, std::size_t> views_;
  std::map<int, std::set<std::pair<int, int>>> uses_;  ///< material -> mesh, primitive
};

}  // namespace

void check_fabrics(const GltfDocument& document, IssueSink& issues) { FabricCheck(document, issues).check(); }

}  // namespace selvedge
