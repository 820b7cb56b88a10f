#include "converter/mesh/cell_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "converter/mesh/wall_albedo.h"

namespace selvedge {
namespace {

bool is_finite(const V3f& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

Imath::Box3f bounds_of(const CellMesh& mesh) {
  Imath::Box3f box;
  for (const V3i& triangle : mesh.triangles)
    for (const int v : {triangle.x, triangle.y, triangle.z}) box.extendBy(mesh.positions[v]);
  return box;
}

Result<void> validate(const CellMesh& mesh, const std::string& name) {
  for (unsigned i = 0; i < 2; ++i)
    if (!(mesh.period[i] > 0) || !std::isfinite(mesh.period[i]))
      return fail(Code::mesh_invalid, name, i == 0 ? "period x" : "period y",
                  fmt::format("must be positive, is {}", mesh.period[i]));
  if (mesh.triangles.empty()) return fail(Code::mesh_empty, name, "", "the mesh has no triangles");
  const auto infinite = std::ranges::find_if_not(mesh.positions, is_finite);
  if (infinite != mesh.positions.end())
    return fail(Code::mesh_not_finite, name, fmt::format("vertex {}", infinite - mesh.positions.begin()),
                "the position is NaN or infinite");
  const bool has_area = std::ranges::any_of(mesh.triangles, [&](const V3i& t) {
    const auto position = [&](int v) { return V3d(mesh.positions[v]); };
    return (position(t.y) - position(t.x)).cross(position(t.z) - position(t.x)).length2() > 0;
  });
  if (!has_area) return fail(Code::mesh_empty, name, "", "no triangle of the mesh has an area");
  return {};
}

YarnCell yarn_cell_of(const CellMesh& mesh) {
  YarnCell cell{mesh.period, mesh.yarns, std::vector<V3f>(mesh.yarns.curves.size(), V3f(0, 0, 0)), 0};
  const auto bounds = bounds_of(mesh);
  for (V3f& node : cell.yarns.nodes) node.z -= bounds.min.z;
  cell.thickness = static_cast<double>(bounds.max.z - bounds.min.z);
  for (std::size_t v = 0; v < mesh.transmission.size(); ++v) {
    const auto t = static_cast<double>(mesh.transmission[v]);
    const V3f through(ply_wall_albedo(V3d(mesh.albedo[v]), t) * t);
    // Places of found yarn are not known: it has what any vertex has.
    if (mesh.yarn_places.empty())
      std::ranges::fill(cell.wall_transmission, through);
    else if (mesh.yarn_places[v].curve >= 0)
      cell.wall_transmission[mesh.yarn_places[v].curve] = through;
  }
  return cell;
}

void move_to_ground(YarnCell& cell) {
  float low = 1e30F;
  float high = -1e30F;
  for_each_curve(cell.yarns, [&](std::size_t, const YarnCurve& curve, std::span<const V3f> nodes) {
    for (const Yarns::Segment& s : make_segments(curve, nodes, V2f(cell.period))) {
      low = std::min(low, s.start.z - s.half_height());
      high = std::max(high, s.start.z + s.half_height());
    }
  });
  for (V3f& node : cell.yarns.nodes) node.z -= low;
  cell.thickness = static_cast<double>(high - low);
}

}  // namespace selvedge
