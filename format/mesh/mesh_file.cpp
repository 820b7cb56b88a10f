#include "format/mesh/mesh_file.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "format/base/guard.h"

namespace selvedge {
namespace {

/// The columns of the first list of names that are all there; empty without.
std::vector<const PlyProperty*> find_first(
    const PlyElement& element, std::initializer_list<std::initializer_list<std::string_view>> choices) {
  for (const auto& names : choices)
    if (auto found = element.find_all(names); !found.empty()) return found;
  return {};
}

/// Item `i` of three columns.
V3d vector_at(const std::vector<const PlyProperty*>& columns, std::size_t i) {
  return {columns[0]->values[i], columns[1]->values[i], columns[2]->values[i]};
}

MeshColours colours_of(const PlyElement& element) {
  MeshColours colours;
  const auto columns = find_first(element, {{"yarn_red", "yarn_green", "yarn_blue"},
                                            {"red", "green", "blue"},
                                            {"r", "g", "b"},
                                            {"diffuse_red", "diffuse_green", "diffuse_blue"}});
  if (columns.empty()) return colours;
  colours.is_srgb = columns[2]->type.kind != 'f';
  const V3d full(columns[0]->type.full_scale(), columns[1]->type.full_scale(), columns[2]->type.full_scale());
  for (std::size_t i = 0; i < element.count; ++i) colours.values.emplace_back(vector_at(columns, i) / full);
  return colours;
}

class PlyMesh {
 public:
  PlyMesh(const PlyFile& ply, const std::string& file) : ply_(ply), file_(file) {}

  MeshFile read() {
    if (const PlyElement* vertices = ply_.find("vertex")) read_vertices(*vertices);
    if (const PlyElement* faces = ply_.find("face")) read_faces(*faces);
    return std::move(mesh_);
  }

 private:
  void read_vertices(const PlyElement& vertices) {
    const auto positions = vertices.find_all({"x", "y", "z"});
    if (positions.empty()) refuse("element vertex", "needs the properties x, y and z");
    const auto normals = vertices.find_all({"nx", "ny", "nz"});
    const auto uvs = find_first(vertices, {{"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}});
    for (std::size_t i = 0; i < vertices.count; ++i) {
      const V3d position = vector_at(positions, i);
      const V3f single(position);
      if (!std::isfinite(single.x) || !std::isfinite(single.y) || !std::isfinite(single.z))
        throw Failure{{Code::mesh_not_finite, file_, fmt::format("vertex {}", i), "is not finite"}};
      mesh_.positions.push_back(position);
      if (!normals.empty()) mesh_.normals.push_back(vector_at(normals, i));
      if (!uvs.empty()) add_uv(uvs[0]->values[i], uvs[1]->values[i], "vertex", i);
    }
    mesh_.colours = colours_of(vertices);
  }

  void read_faces(const PlyElement& faces) {
    const PlyProperty* indices = faces.find_list({"vertex_indices", "vertex_index"});
    const PlyProperty* uvs = faces.find_list({"texcoord"});
    const bool uvs_of_vertices = !mesh_.uvs.empty();
    std::size_t first = 0;
    std::size_t first_uv = 0;
    for (std::size_t f = 0; indices != nullptr && f < faces.count; ++f) {
      const std::size_t end = indices->list_ends[f];
      const std::size_t end_uv = uvs == nullptr ? 0 : uvs->list_ends[f];
      const bool own_uvs = uvs != nullptr && end_uv - first_uv == 2 * (end - first) && end > first;
      for (; first < end; ++first, first_uv += 2 * (own_uvs ? 1 : 0)) {
        const double index = indices->values[first];
        if (!(index >= 0 && index < static_cast<double>(mesh_.positions.size())))
          refuse(fmt::format("face {}", f), "vertex index out of range");
        MeshCorner corner{static_cast<int>(index)};
        if (!mesh_.normals.empty()) corner.normal = corner.position;
        if (uvs_of_vertices) corner.uv = corner.position;
        if (own_uvs) {
          corner.uv = static_cast<int>(mesh_.uvs.size());
          add_uv(uvs->values[first_uv], uvs->values[first_uv + 1], "face", f);
        }
        mesh_.corners.push_back(corner);
      }
      first_uv = end_uv;
      mesh_.face_ends.push_back(mesh_.corners.size());
    }
    mesh_.face_colours = colours_of(faces);
  }

  void add_uv(double u, double v, const char* element, std::size_t item) {
    const V2f& uv = mesh_.uvs.emplace_back(static_cast<float>(u), static_cast<float>(1 - v));
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y))
      refuse(fmt::format("{} {}", element, item), "texture coordinates are not finite");
  }

  [[noreturn]] void refuse(std::string place, std::string why) const {
    throw Failure{{Code::file_damaged, file_, std::move(place), std::move(why)}};
  }

  const PlyFile& ply_;
  const std::string& file_;
  MeshFile mesh_;
};

}  // namespace

Result<MeshFile> ply_to_mesh(const PlyFile& ply, const std::string& file) {
  return catch_failure([&] { return PlyMesh(ply, file).read(); });
}

}  // namespace selvedge
