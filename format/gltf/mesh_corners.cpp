#include "format/gltf/mesh_corners.h"

#include <filesystem>
#include <unordered_map>

#include "format/gltf/edit.h"

namespace selvedge {
namespace {

struct MeshCornerHash {
  std::size_t operator()(const MeshCorner& c) const {
    const auto word = [](int i) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)); };
    return (word(c.position) << 32 ^ word(c.uv) << 12 ^ word(c.normal)) * 0x9E3779B97F4A7C15U;
  }
};

/// Sums of the faces' normals by area, at each position.
std::vector<V3d> mean_normals(const MeshCorners& lines) {
  std::vector<V3d> sums(lines.positions.size(), V3d(0, 0, 0));
  for (const auto& [part, corners] : lines.parts) {
    for (std::size_t t = 0; t < corners.size(); t += 3) {
      const V3d& a = lines.positions[corners[t].position];
      const V3d normal =
          (lines.positions[corners[t + 1].position] - a).cross(lines.positions[corners[t + 2].position] - a);
      for (std::size_t k = 0; k < 3; ++k) sums[corners[t + k].position] += normal;
    }
  }
  return sums;
}

/// Appends the vertices of a part and returns the primitive, without its material.
Json primitive_of(GltfDocument& document, const MeshCorners& lines, const std::vector<V3d>& sums,
                  bool has_uvs, const std::vector<MeshCorner>& corners) {
  std::unordered_map<MeshCorner, std::uint32_t, MeshCornerHash> index_of_corner;
  std::vector<float> positions;
  std::vector<float> normals;
  std::vector<float> uvs;
  std::vector<std::uint32_t> indices;
  for (const MeshCorner& corner : corners) {
    const auto [entry, is_new] =
        index_of_corner.try_emplace(corner, static_cast<std::uint32_t>(index_of_corner.size()));
    indices.push_back(entry->second);
    if (!is_new) continue;
    const V3f position(lines.positions[corner.position]);
    const V3d& sum = sums[corner.position];
    const V3f normal = corner.normal >= 0  ? lines.normals[corner.normal]
                       : sum.length2() > 0 ? V3f(sum.normalized())
                                           : V3f(0, 0, 1);
    positions.insert(positions.end(), {position.x, position.y, position.z});
    normals.insert(normals.end(), {normal.x, normal.y, normal.z});
    if (has_uvs) uvs.insert(uvs.end(), {lines.uvs[corner.uv].x, lines.uvs[corner.uv].y});
  }
  Json attributes{{"POSITION", append_float_accessor(document, positions, 3, true)},
                  {"NORMAL", append_float_accessor(document, normals, 3, false)}};
  if (has_uvs) attributes["TEXCOORD_0"] = append_float_accessor(document, uvs, 2, false);
  return {{"attributes", attributes}, {"indices", append_index_accessor(document, indices)}};
}

}  // namespace

GltfDocument document_of_mesh(const std::string& path, const GltfLimits& limits) {
  GltfDocument document;
  document.file = path;
  document.folder = std::filesystem::path(path).parent_path().string();
  document.other_files = limits.other_files;
  document.json = Json::parse(R"({"asset": {"version": "2.0", "generator": "selvedge"}, "scene": 0,
    "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": []}]})");
  return document;
}

void append_parts(GltfDocument& document, const MeshCorners& mesh,
                  const std::function<int(const std::string&)>& material_of) {
  const std::vector<V3d> sums = mean_normals(mesh);
  for (const auto& [part, corners] : mesh.parts) {
    Json primitive = primitive_of(document, mesh, sums, part.has_uvs, corners);
    primitive["material"] = material_of(part.material);
    document.json["meshes"][0]["primitives"].push_back(primitive);
  }
}

}  // namespace selvedge
