// Meshes whose faces name positions, texture coordinates and normals apart, as OBJ and PLY have them, read as
// glTF documents.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "format/base/vec.h"
#include "format/gltf/document.h"

namespace selvedge {

/// What a corner of a face names; negative: nothing.
struct MeshCorner {
  int position = -1;
  int uv = -1;
  int normal = -1;
  bool operator==(const MeshCorner&) const = default;
};

/// A corner with its share of the maps and buffers that are made of it.
inline constexpr std::uint64_t corner_price = 128;
/// JSON values of a primitive with its accessors, views and material.
inline constexpr std::uint64_t values_of_part = 128;

/// A primitive: the triangles of one material, with or without texture coordinates.
struct MeshPart {
  std::string material;
  bool has_uvs = false;
  bool operator<(const MeshPart& other) const {
    return std::tie(material, has_uvs) < std::tie(other.material, other.has_uvs);
  }
};

/// A mesh whose faces name positions, texture coordinates and normals apart. No index is out of range.
struct MeshCorners {
  std::vector<V3d> positions;
  std::vector<V3f> normals;
  std::vector<V2f> uvs;                               ///< as glTF has them
  std::map<MeshPart, std::vector<MeshCorner>> parts;  ///< three corners a triangle
};

/// A document with one mesh that has no primitives yet, as if read from `path`.
GltfDocument document_of_mesh(const std::string& path, const GltfLimits& limits);

/// Adds a primitive for each part to that mesh. `material_of` gives the document's material of a name.
/// Corners without a normal get the mean of their faces' by area.
void append_parts(GltfDocument& document, const MeshCorners& mesh,
                  const std::function<int(const std::string&)>& material_of);

}  // namespace selvedge
