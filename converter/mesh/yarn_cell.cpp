#include "converter/mesh/yarn_cell.h"

#include <algorithm>

#include "converter/mesh/wall_albedo.h"

namespace selvedge {

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
