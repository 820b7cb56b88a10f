// An inner surface for solid things, so that nobody looks through the holes of their cloth to the far side.
#include <cmath>

#include "converter/dress/dress.h"
#include "converter/dress/fabric_source.h"
#include "converter/dress/flatten.h"
#include "format/gltf/access.h"
#include "format/gltf/edit.h"
#include "format/gltf/geometry.h"

namespace selvedge {
namespace {

/// Unit normals, or zero where there are no triangles: means over the vertices in one point, and where these
/// cancel out, as of two layers back to back, over the vertex alone.
std::vector<V3d> vertex_normals(const std::vector<V3d>& positions,
                                const std::vector<std::uint32_t>& triangles) {
  const std::vector<V3d> own = normal_sums(positions, triangles);
  const std::vector<std::uint32_t> first = weld(positions);
  std::vector<V3d> sums(positions.size(), V3d(0, 0, 0));
  std::vector<double> lengths(positions.size(), 0);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    sums[first[i]] += own[i];
    lengths[first[i]] += own[i].length();
  }
  std::vector<V3d> normals;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const V3d& sum = sums[first[i]];
    const V3d& normal = sum.length() > 1e-3 * lengths[first[i]] ? sum : own[i];
    normals.push_back(normal.length() > 0 ? normal.normalized() : V3d(0, 0, 0));
  }
  return normals;
}

void drop_colors(Json& attributes) {
  for (auto it = attributes.begin(); it != attributes.end();)
    it = it.key().starts_with("COLOR_") ? attributes.erase(it) : std::next(it);
}

/// The backing that an earlier dressing gave the triangles of `backing`, whose material is new and has the
/// same name; null without.
Json* older_backing(const GltfDocument& document, Json& primitives, const Json& backing) {
  const auto name_of = [&](const Json& primitive) {
    return string_of(
        member(root_entry(document, "materials", index_of(member(primitive, "material"))), "name"));
  };
  // They differ in where they lie.
  const auto triangles_of = [](Json primitive) {
    primitive.erase("material");
    primitive["attributes"].erase("POSITION");
    return primitive;
  };
  for (Json& primitive : primitives) {
    if (member(primitive, "material") == member(backing, "material")) continue;
    if (name_of(primitive) != name_of(backing)) continue;
    if (triangles_of(primitive) == triangles_of(backing)) return &primitive;
  }
  return nullptr;
}

}  // namespace

int add_backing(GltfDocument& document, int material, const std::set<PrimitiveIndex>& places,
                const PrimitivesInScene& in_scene, const Backing& backing) {
  const std::string name = string_of(member(document.json["materials"][material], "name"));
  const int behind = append(document.json["materials"],
                            {{"name", name.empty() ? "backing" : name + " backing"},
                             {"pbrMetallicRoughness",
                              {{"baseColorFactor", {backing.color.x, backing.color.y, backing.color.z, 1}},
                               {"metallicFactor", 0},
                               {"roughnessFactor", 1}}}});
  int made = 0;
  for (const PrimitiveIndex& worn : places) {
    const auto seen = in_scene.find(worn);
    if (seen == in_scene.end()) continue;
    const std::string place = member_pointer(worn);
    Json primitive = primitive_at(document, worn);
    GltfReader reader(document);
    const auto positions =
        reader.attribute<V3d>(primitive["attributes"], "POSITION", 0, place + "/attributes");
    const std::vector<std::uint32_t> triangles = read_triangles(reader, primitive, place, positions.size());
    const double local = twice_area_of(positions, triangles);
    if (!(local > 0) || !(seen->second.twice_area > 0)) continue;
    const double distance = backing.distance / std::sqrt(seen->second.twice_area / local);
    const std::vector<V3d> normals = vertex_normals(positions, triangles);
    std::vector<V3f> moved;
    for (std::size_t i = 0; i < positions.size(); ++i)
      moved.push_back(V3f(positions[i]) - V3f(normals[i] * distance));
    for (const char* own : {"extensions", "extras"}) primitive.erase(own);
    drop_colors(primitive["attributes"]);
    if (primitive.contains("targets"))
      for (Json& target : primitive["targets"]) drop_colors(target);
    primitive["attributes"]["POSITION"] = append_float_accessor(document, floats_of(moved), 3, true);
    primitive["material"] = behind;
    Json& primitives = document.json["meshes"][worn.first]["primitives"];
    if (Json* const older = older_backing(document, primitives, primitive))
      *older = std::move(primitive);
    else
      primitives.push_back(std::move(primitive));
    ++made;
  }
  if (made == 0) document.json["materials"].erase(behind);
  return made;
}

}  // namespace selvedge
