#include "converter/dress/add_tangents.h"

#include <fmt/format.h>

#include <numeric>

#include "converter/dress/gather_vertices.h"
#include "format/gltf/edit.h"
#include "format/gltf/geometry.h"
#include "format/scene/tangents.h"

namespace selvedge {

void drop_tangents(Json& primitive) {
  primitive["attributes"].erase("TANGENT");
  if (!primitive.contains("targets")) return;
  for (Json& target : primitive["targets"]) target.erase("TANGENT");
}

bool add_tangents(GltfDocument& document, int mesh, int primitive, int tex_coord) {
  const std::string place = fmt::format("/meshes/{}/primitives/{}", mesh, primitive);
  Json json = document.json["meshes"][mesh]["primitives"][primitive];
  if (!member(member(json, "attributes"), "TANGENT").is_null()) return false;
  GltfReader reader(document);
  std::optional<ScenePrimitive> read =
      read_primitive(reader, json, place, std::numeric_limits<std::uint32_t>::max());
  if (!read) return false;
  ScenePrimitive& vertices = *read;
  const std::vector<V2d>& uvs = vertices.tex_coords[tex_coord];
  if (uvs.empty()) {
    reader.fail(Code::garment_no_uvs, place + "/attributes", fmt::format("no TEXCOORD_{}", tex_coord));
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
    gather_vertices(document, reader, json, sources, place);
    json["indices"] = append_index_accessor(document, tangents.indices);
    json.erase("mode");
  }
  if (flat)
    json["attributes"]["NORMAL"] = append_float_accessor(document, floats_of(vertices.normals), 3, false);
  json["attributes"]["TANGENT"] = append_float_accessor(document, floats_of(tangents.tangents), 4, false);
  document.json["meshes"][mesh]["primitives"][primitive] = std::move(json);
  return true;
}

}  // namespace selvedge
