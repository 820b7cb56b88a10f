// The JSON of glTF 2.0 (chapter 5 of its specification) as tables: one row per member, one table per object.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <string_view>

#include "format/check/gltf_parts.h"
#include "format/gltf/access.h"
#include "format/gltf/names.h"

namespace selvedge {
namespace {

constexpr double any = std::numeric_limits<double>::infinity();

enum class Kind {
  text,
  flag,
  number,
  integer,
  reference,  ///< an index into the root's array `of`
  object,     ///< described by the table `of`, if there is one
  map         ///< an object of references into `of`
};

enum class Need { optional, required };

/// A member, or an array of such values where `most` > 0.
struct Member {
  std::string_view name;
  Kind kind;
  Need need = Need::optional;
  std::string_view of = {};
  double low = -any;
  double high = any;
  std::size_t least = 0;  ///< elements of the array
  std::size_t most = 0;
  bool above = false;   ///< the value is greater than `low`, not equal
  bool unique = false;  ///< elements differ
};

constexpr std::size_t many = std::numeric_limits<std::size_t>::max();
constexpr Need required = Need::required;
constexpr Need optional = Need::optional;

constexpr Member text(std::string_view name, Need need = optional) { return {name, Kind::text, need}; }
constexpr Member flag(std::string_view name) { return {name, Kind::flag}; }
constexpr Member number(std::string_view name, double low = -any, double high = any, Need need = optional) {
  return {name, Kind::number, need, {}, low, high};
}
constexpr Member above(std::string_view name, double low, Need need = optional) {
  return {name, Kind::number, need, {}, low, any, 0, 0, true};
}
constexpr Member integer(std::string_view name, double low, double high = any, Need need = optional) {
  return {name, Kind::integer, need, {}, low, high};
}
constexpr Member reference(std::string_view name, std::string_view of, Need need = optional) {
  return {name, Kind::reference, need, of};
}
constexpr Member object(std::string_view name, std::string_view of = {}, Need need = optional) {
  return {name, Kind::object, need, of};
}
constexpr Member list(Member member, std::size_t least = 1, std::size_t most = many, bool unique = false) {
  member.least = least;
  member.most = most;
  member.unique = unique;
  return member;
}

constexpr std::array root_members{object("asset", "asset", required),
                                  list(text("extensionsUsed"), 1, many, true),
                                  list(text("extensionsRequired"), 1, many, true),
                                  list(object("accessors", "accessor")),
                                  list(object("animations", "animation")),
                                  list(object("buffers", "buffer")),
                                  list(object("bufferViews", "bufferView")),
                                  list(object("cameras", "camera")),
                                  list(object("images", "image")),
                                  list(object("materials", "material")),
                                  list(object("meshes", "mesh")),
                                  list(object("nodes", "node")),
                                  list(object("samplers", "sampler")),
                                  reference("scene", "scenes"),
                                  list(object("scenes", "scene")),
                                  list(object("skins", "skin")),
                                  list(object("textures", "texture"))};
constexpr std::array asset_members{text("version", required), text("minVersion"), text("generator"),
                                   text("copyright")};
constexpr std::array accessor_members{reference("bufferView", "bufferViews"),
                                      integer("byteOffset", 0),
                                      integer("componentType", 0, any, required),
                                      flag("normalized"),
                                      integer("count", 1, any, required),
                                      text("type", required),
                                      list(number("max"), 1, 16),
                                      list(number("min"), 1, 16),
                                      object("sparse", "sparse")};
constexpr std::array sparse_members{integer("count", 1, any, required),
                                    object("indices", "sparse indices", required),
                                    object("values", "sparse values", required)};
constexpr std::array sparse_indices_members{reference("bufferView", "bufferViews", required),
                                            integer("byteOffset", 0),
                                            integer("componentType", 0, any, required)};
constexpr std::array sparse_values_members{reference("bufferView", "bufferViews", required),
                                           integer("byteOffset", 0)};
constexpr std::array animation_members{list(object("channels", "channel", required)),
                                       list(object("samplers", "animation sampler", required))};
constexpr std::array channel_members{integer("sampler", 0, any, required),
                                     object("target", "target", required)};
constexpr std::array target_members{reference("node", "nodes"), text("path", required)};
constexpr std::array animation_sampler_members{reference("input", "accessors", required),
                                               text("interpolation"),
                                               reference("output", "accessors", required)};
constexpr std::array buffer_members{text("uri"), integer("byteLength", 1, any, required)};
constexpr std::array buffer_view_members{reference("buffer", "buffers", required), integer("byteOffset", 0),
                                         integer("byteLength", 1, any, required),
                                         integer("byteStride", 4, 252), integer("target", 0)};
constexpr std::array camera_members{text("type", required), object("perspective", "perspective"),
                                    object("orthographic", "orthographic")};
constexpr std::array perspective_members{above("aspectRatio", 0), above("yfov", 0, required),
                                         above("zfar", 0), above("znear", 0, required)};
constexpr std::array orthographic_members{number("xmag", -any, any, required),
                                          number("ymag", -any, any, required), above("zfar", 0, required),
                                          number("znear", 0, any, required)};
constexpr std::array image_members{text("uri"), text("mimeType"), reference("bufferView", "bufferViews")};
constexpr std::array material_members{object("pbrMetallicRoughness", "pbr"),
                                      object("normalTexture", "normal texture"),
                                      object("occlusionTexture", "occlusion texture"),
                                      object("emissiveTexture", "texture info"),
                                      list(number("emissiveFactor", 0, 1), 3, 3),
                                      text("alphaMode"),
                                      number("alphaCutoff", 0),
                                      flag("doubleSided")};
constexpr std::array pbr_members{list(number("baseColorFactor", 0, 1), 4, 4),
                                 object("baseColorTexture", "texture info"), number("metallicFactor", 0, 1),
                                 number("roughnessFactor", 0, 1),
                                 object("metallicRoughnessTexture", "texture info")};
constexpr std::array texture_info_members{reference("index", "textures", required), integer("texCoord", 0)};
constexpr std::array normal_texture_members{reference("index", "textures", required), integer("texCoord", 0),
                                            number("scale")};
constexpr std::array occlusion_texture_members{reference("index", "textures", required),
                                               integer("texCoord", 0), number("strength", 0, 1)};
constexpr std::array transform_members{list(number("offset"), 2, 2), number("rotation"),
                                       list(number("scale"), 2, 2), integer("texCoord", 0)};
constexpr std::array mesh_members{list(object("primitives", "primitive", required)), list(number("weights"))};
constexpr std::array primitive_members{Member{"attributes", Kind::map, required, "accessors"},
                                       reference("indices", "accessors"), reference("material", "materials"),
                                       integer("mode", 0, 6),
                                       list(Member{"targets", Kind::map, optional, "accessors"})};
constexpr std::array node_members{
    reference("camera", "cameras"), list(reference("children", "nodes"), 1, many, true),
    reference("skin", "skins"),     list(number("matrix"), 16, 16),
    reference("mesh", "meshes"),    list(number("rotation", -1, 1), 4, 4),
    list(number("scale"), 3, 3),    list(number("translation"), 3, 3),
    list(number("weights"))};
constexpr std::array sampler_members{integer("magFilter", 0), integer("minFilter", 0), integer("wrapS", 0),
                                     integer("wrapT", 0)};
constexpr std::array scene_members{list(reference("nodes", "nodes"), 1, many, true)};
constexpr std::array skin_members{reference("inverseBindMatrices", "accessors"),
                                  reference("skeleton", "nodes"),
                                  list(reference("joints", "nodes", required), 1, many, true)};
constexpr std::array texture_members{reference("sampler", "samplers"), reference("source", "images")};

constexpr std::array variants_members{list(object("variants", "variant", required))};
constexpr std::array variant_members{text("name", required)};
constexpr std::array worn_variants_members{list(object("mappings", "mapping", required))};
constexpr std::array mapping_members{reference("material", "materials", required),
                                     list(integer("variants", 0, any, required)), text("name")};

struct Table {
  std::string_view name;
  std::span<const Member> members;
};

constexpr std::array tables{Table{"asset", asset_members},
                            Table{"accessor", accessor_members},
                            Table{"sparse", sparse_members},
                            Table{"sparse indices", sparse_indices_members},
                            Table{"sparse values", sparse_values_members},
                            Table{"animation", animation_members},
                            Table{"channel", channel_members},
                            Table{"target", target_members},
                            Table{"animation sampler", animation_sampler_members},
                            Table{"buffer", buffer_members},
                            Table{"bufferView", buffer_view_members},
                            Table{"camera", camera_members},
                            Table{"perspective", perspective_members},
                            Table{"orthographic", orthographic_members},
                            Table{"image", image_members},
                            Table{"material", material_members},
                            Table{"pbr", pbr_members},
                            Table{"texture info", texture_info_members},
                            Table{"normal texture", normal_texture_members},
                            Table{"occlusion texture", occlusion_texture_members},
                            Table{"mapping", mapping_members},
                            Table{"mesh", mesh_members},
                            Table{"primitive", primitive_members},
                            Table{"node", node_members},
                            Table{"sampler", sampler_members},
                            Table{"scene", scene_members},
                            Table{"skin", skin_members},
                            Table{"texture", texture_members},
                            Table{"variant", variant_members}};

std::span<const Member> members_of(std::string_view table) {
  for (const Table& candidate : tables) {
    if (candidate.name == table) return candidate.members;
  }
  return {};
}

/// Members with a fixed set of values. What a reader does with another one: it guesses or it cannot read.
struct Choice {
  std::string_view table;
  std::string_view name;
  Code code;
  std::span<const std::string_view> texts;
  std::span<const int> numbers;
};

constexpr std::array<std::string_view, 7> accessor_types{"SCALAR", "VEC2", "VEC3", "VEC4",
                                                         "MAT2",   "MAT3", "MAT4"};
constexpr std::array<std::string_view, 3> alpha_modes{"OPAQUE", "MASK", "BLEND"};
constexpr std::array<std::string_view, 2> camera_types{"perspective", "orthographic"};
constexpr std::array<std::string_view, 3> interpolations{"LINEAR", "STEP", "CUBICSPLINE"};
constexpr std::array component_types{5120, 5121, 5122, 5123, 5125, 5126};
constexpr std::array index_types{5121, 5123, 5125};
constexpr std::array targets{34962, 34963};
constexpr std::array mag_filters{9728, 9729};
constexpr std::array min_filters{9728, 9729, 9984, 9985, 9986, 9987};
constexpr std::array wraps{10497, 33071, 33648};

constexpr std::array choices{
    Choice{"accessor", "type", Code::gltf_malformed, accessor_types, {}},
    Choice{"accessor", "componentType", Code::gltf_malformed, {}, component_types},
    Choice{"sparse indices", "componentType", Code::gltf_malformed, {}, index_types},
    Choice{"bufferView", "target", Code::gltf_advice, {}, targets},
    Choice{"material", "alphaMode", Code::gltf_advice, alpha_modes, {}},
    Choice{"camera", "type", Code::gltf_advice, camera_types, {}},
    Choice{"animation sampler", "interpolation", Code::gltf_advice, interpolations, {}},
    Choice{"sampler", "magFilter", Code::gltf_advice, {}, mag_filters},
    Choice{"sampler", "minFilter", Code::gltf_advice, {}, min_filters},
    Choice{"sampler", "wrapS", Code::gltf_advice, {}, wraps},
    Choice{"sampler", "wrapT", Code::gltf_advice, {}, wraps},
};

/// Members that mean nothing without another one.
struct Dependency {
  std::string_view table;
  const char* name;
  const char* needs;
};

constexpr std::array dependencies{Dependency{"accessor", "byteOffset", "bufferView"},
                                  Dependency{"image", "bufferView", "mimeType"},
                                  Dependency{"", "extensionsRequired", "extensionsUsed"}};

class SchemaCheck {
 public:
  SchemaCheck(const Json& root, IssueSink& issues) : root_(root), issues_(issues) {}

  void check() {
    check_object(root_, "", root_members, "");
    check_extensions(root_, "");
    for_each_object(root_, "materials", [&](const Json& material, int index) {
      check_transforms(material, fmt::format("/materials/{}", index));
    });
    check_variants();
  }

 private:
  void wrong(const std::string& place, std::string message) {
    issues_.add(Code::gltf_malformed, place, std::move(message));
  }

  void check_object(const Json& json, std::string_view table, std::span<const Member> members,
                    const std::string& place) {
    for (const Member& row : members) {
      const auto found = json.find(row.name);
      const std::string where = place + "/" + std::string(row.name);
      if (found == json.end()) {
        if (row.need == required) wrong(where, "is missing");
        continue;
      }
      if (row.most == 0) {
        check_value(*found, row, where);
      } else {
        check_array(*found, row, where);
      }
      check_choice(*found, table, row.name, where);
    }
    for (const Dependency& rule : dependencies) {
      if (rule.table == table && json.contains(rule.name) && !json.contains(rule.needs)) {
        wrong(place + "/" + rule.name, fmt::format("stands without {}", rule.needs));
      }
    }
    for (const char* name : {"extensions", "name"}) {
      const Json& value = member(json, name);
      const bool good = std::string_view(name) == "name" ? value.is_string() : value.is_object();
      if (!value.is_null() && !good) wrong(place + "/" + name, "is of the wrong type");
    }
  }

  /// Every extension of anything is an object.
  void check_extensions(const Json& json, const std::string& place) {
    if (!json.is_structured()) return;
    const Json& extensions = member(json, "extensions");
    if (extensions.is_object()) {
      for (const auto& [name, value] : extensions.items()) {
        if (!value.is_object()) wrong(pointer_to(place + "/extensions", name), "is not an object");
      }
    }
    if (json.is_array()) {
      for (std::size_t i = 0; i < json.size(); ++i) check_extensions(json[i], fmt::format("{}/{}", place, i));
    } else {
      for (const auto& [name, value] : json.items()) {
        if (name != "extras") check_extensions(value, pointer_to(place, name));
      }
    }
  }

  void check_array(const Json& json, const Member& row, const std::string& place) {
    if (!json.is_array()) return wrong(place, "is not an array");
    if (json.size() < row.least || json.size() > row.most) {
      wrong(place, json.empty() ? "is empty" : fmt::format("has {} elements", json.size()));
    }
    std::set<double> seen_numbers;
    std::set<std::string> seen_texts;
    for (std::size_t i = 0; i < json.size(); ++i) {
      const std::string where = fmt::format("{}/{}", place, i);
      check_value(json[i], row, where);
      if (!row.unique) continue;
      const bool fresh = json[i].is_number()   ? seen_numbers.insert(json[i].get<double>()).second
                         : json[i].is_string() ? seen_texts.insert(json[i].get<std::string>()).second
                                               : true;
      if (!fresh) wrong(where, fmt::format("{} stands there twice", excerpt(json[i])));
    }
  }

  void check_value(const Json& json, const Member& row, const std::string& place) {
    switch (row.kind) {
      case Kind::text:
        if (!json.is_string()) wrong(place, "is not a string");
        return;
      case Kind::flag:
        if (!json.is_boolean()) wrong(place, "is neither true nor false");
        return;
      case Kind::number:
      case Kind::integer:
        return check_number(json, row, place);
      case Kind::reference:
        return check_reference(json, row.of, place);
      case Kind::object:
        if (!json.is_object()) return wrong(place, "is not an object");
        return check_object(json, row.of, members_of(row.of), place);
      case Kind::map:
        if (!json.is_object()) return wrong(place, "is not an object");
        if (json.empty()) wrong(place, "is empty");
        for (const auto& [name, value] : json.items())
          check_reference(value, row.of, pointer_to(place, name));
        return;
    }
  }

  void check_number(const Json& json, const Member& row, const std::string& place) {
    if (!json.is_number()) return wrong(place, "is not a number");
    const double value = json.get<double>();
    if (row.kind == Kind::integer && value != std::floor(value)) {
      wrong(place, fmt::format("{} is not a whole number", value));
    } else if (!(value >= row.low && value <= row.high) || (row.above && value == row.low)) {
      wrong(place, fmt::format("{} is out of range", excerpt(json)));
    }
  }

  void check_reference(const Json& json, std::string_view array, const std::string& place) {
    const int index = index_of(json);
    if (index < 0) return wrong(place, fmt::format("{} is not an index", excerpt(json)));
    const Json& entries = member(root_, std::string(array).c_str());
    if (!entries.is_array() || static_cast<std::size_t>(index) >= entries.size()) {
      issues_.add(Code::gltf_accessor, place, fmt::format("there is no /{}/{}", array, index));
    }
  }

  void check_choice(const Json& json, std::string_view table, std::string_view name,
                    const std::string& place) {
    for (const Choice& choice : choices) {
      if (choice.table != table || choice.name != name) continue;
      bool known = false;
      for (const std::string_view text : choice.texts) known = known || json == text;
      for (const int value : choice.numbers) known = known || json == value;
      if (!known)
        issues_.add(choice.code, place, fmt::format("{} is not one of the known values", excerpt(json)));
    }
  }

  /// KHR_texture_transform wherever a material has one, and the textures of a material's extensions.
  void check_transforms(const Json& json, const std::string& place) {
    for (const auto& [name, value] : json.items()) {
      if (!value.is_object() || name == "extras") continue;
      const std::string where = pointer_to(place, name);
      if (name == names::gltf::texture_transform) check_object(value, name, transform_members, where);
      const bool of_extension = place.find("/extensions/") != std::string::npos;
      if (of_extension && name.ends_with("Texture")) {
        check_object(value, "texture info", texture_info_members, where);
      }
      check_transforms(value, where);
    }
  }

  /// KHR_materials_variants: what it adds to the root and to primitives.
  void check_variants() {
    const Json& extension = member(member(root_, "extensions"), names::gltf::variants);
    if (extension.is_object()) {
      const std::string place = std::string("/extensions/") + names::gltf::variants;
      check_object(extension, "variants", variants_members, place);
    }
    const Json& variants = member(extension, "variants");
    for_each_object(root_, "meshes", [&](const Json& mesh, int m) {
      for_each_object(mesh, "primitives", [&](const Json& primitive, int p) {
        const Json& worn = member(member(primitive, "extensions"), names::gltf::variants);
        if (!worn.is_object()) return;
        const std::string place =
            fmt::format("/meshes/{}/primitives/{}/extensions/{}", m, p, names::gltf::variants);
        check_object(worn, "worn variants", worn_variants_members, place);
        check_mappings(worn, variants.is_array() ? variants.size() : 0, place + "/mappings");
      });
    });
  }

  /// A variant has one material on each primitive.
  void check_mappings(const Json& worn, std::size_t variants, const std::string& place) {
    std::set<int> mapped;
    for_each_object(worn, "mappings", [&](const Json& mapping, int index) {
      const Json& list = member(mapping, "variants");
      for (std::size_t i = 0; list.is_array() && i < list.size(); ++i) {
        const std::string where = fmt::format("{}/{}/variants/{}", place, index, i);
        const int variant = index_of(list[i]);
        if (variant < 0) continue;  // named by the table
        if (static_cast<std::size_t>(variant) >= variants) {
          issues_.add(Code::gltf_accessor, where, fmt::format("there is no variant {}", variant));
        } else if (!mapped.insert(variant).second) {
          wrong(where, fmt::format("variant {} is mapped twice", variant));
        }
      }
    });
  }

  const Json& root_;
  IssueSink& issues_;
};

}  // namespace

void check_schema(const Json& root, IssueSink& issues) { SchemaCheck(root, issues).check(); }

}  // namespace selvedge
