#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <set>
#include <string_view>

#include "format/check/gltf_parts.h"
#include "format/gltf/access.h"
#include "format/gltf/fabric_extension.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

constexpr std::string_view quantization = "KHR_mesh_quantization";

/// Bits of a set of component types; the upper half: normalised.
constexpr unsigned int8 = 1, uint8 = 2, int16 = 4, uint16 = 8, float32 = 16;
constexpr unsigned normal(unsigned types) { return types << 8; }

/// The formats of an attribute: glTF 2.0 section 3.7.2.1, and what KHR_mesh_quantization adds.
struct Semantic {
  std::string_view name;  ///< with "_" at the end where a number follows
  std::string_view types;
  unsigned formats;
  unsigned quantized;
};

constexpr std::array semantics{
    Semantic{"POSITION", "VEC3", float32,
             int8 | uint8 | int16 | uint16 | normal(int8 | uint8 | int16 | uint16)},
    Semantic{"NORMAL", "VEC3", float32, normal(int8 | int16)},
    Semantic{"TANGENT", "VEC4", float32, normal(int8 | int16)},
    Semantic{"TEXCOORD_", "VEC2", float32 | normal(uint8 | uint16),
             int8 | uint8 | int16 | uint16 | normal(int8 | int16)},
    Semantic{"COLOR_", "VEC3 VEC4", float32 | normal(uint8 | uint16), 0},
    Semantic{"JOINTS_", "VEC4", uint8 | uint16, 0},
    Semantic{"WEIGHTS_", "VEC4", float32 | normal(uint8 | uint16), 0},
};

/// Differences that morph targets hold.
constexpr std::array morph_semantics{
    Semantic{"POSITION", "VEC3", float32, int8 | int16 | normal(int8 | int16)},
    Semantic{"NORMAL", "VEC3", float32, int8 | int16 | normal(int8 | int16)},
    Semantic{"TANGENT", "VEC3", float32, int8 | int16 | normal(int8 | int16)},
    Semantic{"TEXCOORD_", "VEC2", float32 | normal(int8 | uint8 | int16 | uint16), int8 | int16},
    Semantic{"COLOR_", "VEC3 VEC4", float32 | normal(int8 | uint8 | int16 | uint16), 0},
};

unsigned format_of(const AccessorShape& shape) {
  unsigned format = 0;
  if (shape.component_type == 5120) format = int8;
  if (shape.component_type == 5121) format = uint8;
  if (shape.component_type == 5122) format = int16;
  if (shape.component_type == 5123) format = uint16;
  if (shape.component_type == 5126) format = float32;
  return shape.normalized ? normal(format) : format;
}

/// The number of "TEXCOORD_1"; -1 if `name` is not `stem` and a number.
int number_behind(std::string_view name, std::string_view stem) {
  if (!name.starts_with(stem)) return -1;
  const std::string_view digits = name.substr(stem.size());
  if (digits.empty() || (digits.size() > 1 && digits[0] == '0')) return -1;
  int number = -1;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return error == std::errc() && end == digits.data() + digits.size() ? number : -1;
}

template <std::size_t size>
const Semantic* find_semantic(const std::array<Semantic, size>& table, std::string_view name) {
  for (const Semantic& row : table) {
    if (row.name.ends_with('_') ? number_behind(name, row.name) >= 0 : row.name == name) return &row;
  }
  return nullptr;
}

class MeshCheck {
 public:
  MeshCheck(const GltfDocument& document, IssueSink& issues)
      : document_(document), root_(document.json), issues_(issues) {
    for (const Json& name : member(root_, "extensionsUsed")) quantized_ = quantized_ || name == quantization;
    for_each_object(root_, "materials", [&](const Json& material, int index) {
      for_each_texture(material, "", [&](const Json& info, const std::string&) {
        int set = std::max(0, index_of(member(info, "texCoord")));
        read_uv_transform(info, set);
        sets_[index].insert(set);
      });
    });
  }

  void check() {
    for_each_object(root_, "meshes", [&](const Json& mesh, int m) {
      std::set<std::size_t> targets;
      for_each_object(mesh, "primitives", [&](const Json& primitive, int p) {
        const std::string place = fmt::format("/meshes/{}/primitives/{}", m, p);
        check_primitive(primitive, place);
        const Json& list = member(primitive, "targets");
        targets.insert(list.is_array() ? list.size() : 0);
      });
      const std::string place = fmt::format("/meshes/{}", m);
      if (targets.size() > 1) wrong(place + "/primitives", "the numbers of morph targets differ");
      const Json& weights = member(mesh, "weights");
      if (weights.is_array() && targets.size() == 1 && weights.size() != *targets.begin()) {
        wrong(place + "/weights", fmt::format("{} weights for {} targets", weights.size(), *targets.begin()));
      }
    });
  }

 private:
  void wrong(const std::string& place, std::string message) {
    issues_.add(Code::gltf_malformed, place, std::move(message));
  }

  void check_primitive(const Json& primitive, const std::string& place) {
    const Json& attributes = member(primitive, "attributes");
    if (!attributes.is_object()) return;
    const bool compressed = !member(member(primitive, "extensions"), names::gltf::draco).is_null();
    std::map<std::size_t, std::string> counts;
    for (const auto& [name, accessor] : attributes.items()) {
      const std::string where = pointer_to(place + "/attributes", name);
      check_attribute(name, index_of(accessor), where, compressed, false);
      if (const auto shape = shape_of(document_, index_of(accessor), where)) {
        counts.try_emplace(shape->count, name);
      }
    }
    if (counts.size() > 1) {
      wrong(place + "/attributes",
            fmt::format("{} has {} elements, {} has {}", counts.begin()->second, counts.begin()->first,
                        counts.rbegin()->second, counts.rbegin()->first));
    }
    check_sets(attributes, place + "/attributes");
    if (!attributes.contains("POSITION")) {
      issues_.add(Code::gltf_advice, place + "/attributes", "no POSITION: there is nothing to draw");
    }
    if (attributes.contains("TANGENT") && !attributes.contains("NORMAL")) {
      issues_.add(Code::gltf_advice, place + "/attributes/TANGENT", "tangents without normals are not used");
    }
    check_indices(primitive, place, counts.empty() ? 0 : counts.begin()->first, compressed);
    check_targets(primitive, place, counts.empty() ? 0 : counts.begin()->first);
    check_materials(primitive, attributes, place);
  }

  void check_attribute(const std::string& name, int accessor, const std::string& place, bool compressed,
                       bool morph) {
    const Result<AccessorShape> shape = shape_of(document_, accessor, place);
    const Semantic* semantic = morph ? find_semantic(morph_semantics, name) : find_semantic(semantics, name);
    if (semantic == nullptr && !name.starts_with('_')) return wrong(place, "is no name of an attribute");
    if (!shape) return;
    const Json& json = root_["accessors"][accessor];
    const std::string type = json["type"].get<std::string>();
    if (shape->component_type == 5125) wrong(place, "attributes cannot be of 32-bit integers");
    if (semantic != nullptr) {
      const unsigned allowed = semantic->formats | (quantized_ ? semantic->quantized : 0U);
      if (semantic->types.find(type) == std::string_view::npos || (format_of(*shape) & allowed) == 0) {
        wrong(place, fmt::format("{} of component type {}{} is no format of this attribute", type,
                                 shape->component_type, shape->normalized ? ", normalised," : ""));
      }
    }
    if (name == "POSITION" && (!json.contains("min") || !json.contains("max"))) {
      wrong(place, "accessors of POSITION need min and max");
    }
    if (!compressed) check_alignment(json, *shape, place);
  }

  /// Vertices begin at multiples of 4 bytes.
  void check_alignment(const Json& accessor, const AccessorShape& shape, const std::string& place) {
    const int view = index_of(member(accessor, "bufferView"));
    const Json& views = member(root_, "bufferViews");
    if (view < 0 || !views.is_array() || static_cast<std::size_t>(view) >= views.size()) return;
    const std::size_t size =
        component_size(shape.component_type) * static_cast<std::size_t>(shape.components);
    const std::size_t stride =
        size_of(member(views[view], "byteStride")).value_or(shape.count > 1 ? size : 4);
    const std::size_t offset = size_of(member(accessor, "byteOffset")).value_or(0);
    const std::size_t start = size_of(member(views[view], "byteOffset")).value_or(0);
    if (offset % 4 != 0 || stride % 4 != 0 || (offset + start) % 4 != 0) {
      wrong(place,
            fmt::format("vertices at byte {} and every {} after it are not aligned to 4", offset, stride));
    }
  }

  /// Numbered attributes begin with 0 and leave none out; weights belong to joints.
  void check_sets(const Json& attributes, const std::string& place) {
    std::map<std::string_view, int> counts;
    for (const Semantic& semantic : semantics) {
      if (!semantic.name.ends_with('_')) continue;
      int count = 0;
      int highest = -1;
      for (const auto& [name, accessor] : attributes.items()) {
        const int number = number_behind(name, semantic.name);
        if (number < 0) continue;
        ++count;
        highest = std::max(highest, number);
      }
      if (highest + 1 != count) wrong(place, fmt::format("the numbers of {} leave one out", semantic.name));
      counts[semantic.name] = count;
    }
    if (counts["JOINTS_"] != counts["WEIGHTS_"]) wrong(place, "the numbers of JOINTS and WEIGHTS differ");
  }

  void check_indices(const Json& primitive, const std::string& place, std::size_t vertices, bool compressed) {
    const Json& indices = member(primitive, "indices");
    std::size_t count = vertices;
    if (!indices.is_null()) {
      const auto shape = shape_of(document_, index_of(indices), place);
      if (!shape) return;
      const int type = shape->component_type;
      if (shape->components != 1 || (type != 5121 && type != 5123 && type != 5125) || shape->normalized) {
        wrong(place + "/indices", "indices are SCALAR and of unsigned integers");
      }
      count = shape->count;
    }
    const Json& mode = member(primitive, "mode");
    const int topology = mode.is_null() ? 4 : index_of(mode);
    if (!compressed && topology == 4 && count % 3 != 0) {
      issues_.add(Code::gltf_advice, place,
                  fmt::format("{} vertices or indices do not make triangles: the last is not drawn", count));
    }
  }

  void check_targets(const Json& primitive, const std::string& place, std::size_t vertices) {
    const Json& targets = member(primitive, "targets");
    const Json& attributes = member(primitive, "attributes");
    for (std::size_t t = 0; targets.is_array() && t < targets.size(); ++t) {
      if (!targets[t].is_object()) continue;
      for (const auto& [name, accessor] : targets[t].items()) {
        const std::string where = pointer_to(fmt::format("{}/targets/{}", place, t), name);
        check_attribute(name, index_of(accessor), where, false, true);
        if (!attributes.contains(name)) wrong(where, "the primitive does not have this attribute");
        const auto shape = shape_of(document_, index_of(accessor), where);
        if (shape && vertices > 0 && shape->count != vertices) {
          wrong(where, fmt::format("{} elements for {} vertices", shape->count, vertices));
        }
      }
    }
  }

  /// The primitive's own material and those of its variants.
  void check_materials(const Json& primitive, const Json& attributes, const std::string& place) {
    check_material(member(primitive, "material"), attributes, place + "/material");
    for_each_object(member(member(primitive, "extensions"), names::gltf::variants), "mappings",
                    [&](const Json& mapping, int index) {
                      check_material(member(mapping, "material"), attributes,
                                     fmt::format("{}/extensions/{}/mappings/{}/material", place,
                                                 names::gltf::variants, index));
                    });
  }

  void check_material(const Json& material, const Json& attributes, const std::string& place) {
    const auto found = sets_.find(index_of(material));
    if (found == sets_.end()) return;
    for (const int set : found->second) {
      if (attributes.contains(fmt::format("TEXCOORD_{}", set))) continue;
      wrong(place, fmt::format("a texture of the material takes TEXCOORD_{}", set));
    }
  }

  const GltfDocument& document_;
  const Json& root_;
  IssueSink& issues_;
  bool quantized_ = false;
  std::map<int, std::set<int>> sets_;  ///< UV sets that the textures of each material take
};

}  // namespace

void check_meshes(const GltfDocument& document, IssueSink& issues) { MeshCheck(document, issues).check(); }

}  // namespace selvedge
