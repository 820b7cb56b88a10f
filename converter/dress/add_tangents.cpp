#include "converter/dress/add_tangents.h"

#include <fmt/format.h>

#include <numeric>

#include "format/gltf/edit.h"
#include "format/gltf/geometry.h"
#include "format/scene/tangents.h"

namespace selvedge {
namespace {

template <class V>
std::span<const float> floats(const std::vector<V>& values) {
  static_assert(sizeof(V) == V::dimensions() * sizeof(float));
  return {reinterpret_cast<const float*>(values.data()), values.size() * V::dimensions()};
}

/// A new accessor whose element i is element sources[i] of the old one; -1 after a fault.
int gather(GltfDocument& document, GltfReader& reader, int accessor,
           const std::vector<std::uint32_t>& sources, const std::string& place) {
  AccessorShape shape = reader.accessor_shape(accessor, place);
  const std::vector<std::uint8_t> elements = reader.elements(accessor, place);
  const std::size_t size = shape.element_size();
  std::vector<std::uint8_t> gathered;
  gathered.reserve(sources.size() * size);
  for (const std::uint32_t source : sources) {
    if (source >= shape.count)
      reader.fail(Code::gltf_malformed, place, fmt::format("there is no element {}", source));
    if (reader.fault) return -1;
    const auto first = elements.begin() + static_cast<std::ptrdiff_t>(source * size);
    gathered.insert(gathered.end(), first, first + static_cast<std::ptrdiff_t>(size));
  }
  shape.count = sources.size();
  Json json = document.json["accessors"][accessor];
  json.erase("byteOffset");
  json.erase("sparse");
  json["bufferView"] = append_attribute_view(document, shape, gathered);
  json["count"] = shape.count;
  if (json.contains("min") || json.contains("max")) {
    set_bounds(json, to_floats(gathered, shape.component_type, false), shape.components);
  }
  document.json["accessors"].push_back(std::move(json));
  return static_cast<int>(document.json["accessors"].size()) - 1;
}

void gather_all(GltfDocument& document, GltfReader& reader, Json& attributes,
                const std::vector<std::uint32_t>& sources, const std::string& place) {
  for (const auto& [semantic, accessor] : attributes.items()) {
    accessor = gather(document, reader, index_of(accessor), sources, place + "/" + semantic);
    if (reader.fault) return;
  }
}

}  // namespace

void drop_tangents(GltfDocument& document, int mesh, int primitive) {
  Json& json = document.json["meshes"][mesh]["primitives"][primitive];
  json["attributes"].erase("TANGENT");
  if (!json.contains("targets")) return;
  for (Json& target : json["targets"]) target.erase("TANGENT");
}

Result<bool> add_tangents(GltfDocument& document, int mesh, int primitive, int tex_coord) {
  const std::string place = fmt::format("/meshes/{}/primitives/{}", mesh, primitive);
  Json json = document.json["meshes"][mesh]["primitives"][primitive];
  if (!member(member(json, "attributes"), "TANGENT").is_null()) return false;
  GltfReader reader(document);
  std::optional<ScenePrimitive> read =
      read_primitive(reader, json, place, std::numeric_limits<std::uint32_t>::max());
  if (reader.fault || !read) return reader.result(false);
  ScenePrimitive& vertices = *read;
  const std::vector<V2d>& uvs = vertices.tex_coords[tex_coord];
  if (uvs.empty()) {
    return fail(Code::garment_no_uvs, document.file, place + "/attributes",
                fmt::format("no TEXCOORD_{}", tex_coord));
  }
  for (V3f& normal : vertices.normals) normal.normalize();  // quantised normals are not exactly unit

  // For primitives without normals, read_primitive has made separate vertices for each triangle.
  const bool flat = member(json["attributes"], "NORMAL").is_null();
  std::vector<std::uint32_t> sources(vertices.positions.size());
  std::iota(sources.begin(), sources.end(), 0U);
  if (flat) {
    const Json& position = json["attributes"]["POSITION"];
    const AccessorShape shape = reader.accessor_shape(index_of(position), place);
    sources = read_triangles(reader, json, place, shape.count);
    if (reader.fault) return reader.result(false);
  }
  const std::vector<V3d> positions(vertices.positions.begin(), vertices.positions.end());
  std::vector<V3d> normals(vertices.normals.begin(), vertices.normals.end());
  Tangents tangents = compute_tangents(positions, normals, uvs, vertices.indices, Facing::winding);
  for (const std::uint32_t copied : tangents.copy_of) normals.push_back(normals[copied]);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    V4f& t = tangents.tangents[i];
    if (t.x != 0 || t.y != 0 || t.z != 0) continue;
    const V3f substitute(any_perpendicular(normals[i]));  // glTF does not allow tangents of length 0
    t = V4f(substitute.x, substitute.y, substitute.z, t.w);
  }
  if (flat || !tangents.copy_of.empty()) {
    for (const std::uint32_t copied : tangents.copy_of) {
      sources.push_back(sources[copied]);
      vertices.normals.push_back(vertices.normals[copied]);
    }
    gather_all(document, reader, json["attributes"], sources, place + "/attributes");
    if (json.contains("targets")) {
      for (Json& target : json["targets"]) gather_all(document, reader, target, sources, place + "/targets");
    }
    if (reader.fault) return reader.result(false);
    json["indices"] = append_index_accessor(document, tangents.indices);
    json.erase("mode");
  }
  if (flat)
    json["attributes"]["NORMAL"] = append_float_accessor(document, floats(vertices.normals), 3, false);
  json["attributes"]["TANGENT"] = append_float_accessor(document, floats(tangents.tangents), 4, false);
  document.json["meshes"][mesh]["primitives"][primitive] = std::move(json);
  return true;
}

}  // namespace selvedge
