#include "converter/mesh/cell_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

bool is_finite(const V3f& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

Imath::Box3f bounds_of(const CellMesh& mesh) {
  Imath::Box3f box;
  for (const V3i& triangle : mesh.triangles) {
    for (const int v : {triangle.x, triangle.y, triangle.z}) box.extendBy(mesh.positions[v]);
  }
  return box;
}

Result<void> validate(const CellMesh& mesh, const std::string& name) {
  for (unsigned i = 0; i < 2; ++i) {
    if (!(mesh.period[i] > 0) || !std::isfinite(mesh.period[i])) {
      return fail(Code::mesh_invalid, name, i == 0 ? "period x" : "period y",
                  fmt::format("must be positive, is {}", mesh.period[i]));
    }
  }
  if (mesh.triangles.empty()) return fail(Code::mesh_empty, name, "", "the mesh has no triangles");
  const auto infinite = std::ranges::find_if_not(mesh.positions, is_finite);
  if (infinite != mesh.positions.end()) {
    return fail(Code::mesh_not_finite, name, fmt::format("vertex {}", infinite - mesh.positions.begin()),
                "the position is NaN or infinite");
  }
  const bool has_area = std::ranges::any_of(mesh.triangles, [&](const V3i& t) {
    const auto position = [&](int v) { return V3d(mesh.positions[v]); };
    return (position(t.y) - position(t.x)).cross(position(t.z) - position(t.x)).length2() > 0;
  });
  if (!has_area) return fail(Code::mesh_empty, name, "", "no triangle of the mesh has an area");
  return {};
}

}  // namespace selvedge
