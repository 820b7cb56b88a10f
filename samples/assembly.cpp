#include "samples/assembly.h"

#include <algorithm>
#include <array>

namespace selvedge::samples {

std::vector<V3d> normals_of(const Assembly& assembly) {
  std::vector<V3d> normals(assembly.points.size(), V3d(0, 0, 0));
  for (const Patch& patch : assembly.patches) {
    for (const V3i& t : patch.triangles) {
      const std::array<int, 3> p{patch.points[t[0]], patch.points[t[1]], patch.points[t[2]]};
      const V3d& a = assembly.points[p[0]];
      const V3d normal = (assembly.points[p[1]] - a).cross(assembly.points[p[2]] - a);
      for (const int point : p) normals[point] += normal;
    }
  }
  for (V3d& normal : normals) normal.normalize();
  return normals;
}

Garment garment_of(const Assembly& assembly, const std::string& name) {
  const std::vector<V3d> normals = normals_of(assembly);
  Garment garment;
  garment.name = name;
  for (const Patch& patch : assembly.patches) {
    auto material = std::ranges::find_if(garment.materials,
                                         [&](const GarmentMaterial& m) { return m.name == patch.material; });
    const std::size_t index = material - garment.materials.begin();
    if (material == garment.materials.end()) {
      garment.materials.push_back({.name = patch.material});
      garment.primitives.emplace_back().material = static_cast<int>(index);
    }
    GarmentPrimitive& primitive = garment.primitives[index];
    const std::uint32_t first = static_cast<std::uint32_t>(primitive.positions.size());
    for (std::size_t v = 0; v < patch.points.size(); ++v) {
      const std::size_t point = patch.points[v];
      primitive.positions.emplace_back(assembly.points[point]);
      primitive.normals.emplace_back(V3f(normals[point]).normalized());
      primitive.tex_coords.emplace_back(patch.tex_coords[v]);
    }
    for (const V3i& t : patch.triangles) {
      for (int k = 0; k < 3; ++k) primitive.indices.push_back(first + static_cast<std::uint32_t>(t[k]));
    }
  }
  return garment;
}

}  // namespace selvedge::samples
