#include "samples/panels.h"

#include <Imath/ImathBox.h>

#include <map>

namespace selvedge::samples {

Chart cut_out(const QuadSurface& surface, const std::set<int>& labels, int beyond,
              const std::function<bool(int)>& cut) {
  Chart chart;
  std::map<std::pair<int, bool>, int> vertices;
  for (std::size_t q = 0; q < surface.quads.size(); ++q) {
    if (!labels.contains(surface.labels[q])) continue;
    std::array<int, 4> quad{};
    for (std::size_t k = 0; k < 4; ++k) {
      const int point = surface.quads[q][k];
      const bool second = surface.labels[q] == beyond && cut(point);
      const auto [entry, added] =
          vertices.try_emplace({point, second}, static_cast<int>(chart.points.size()));
      if (added) {
        chart.points.push_back(point);
        chart.panel.positions.push_back(surface.positions[point]);
      }
      quad[k] = entry->second;
    }
    chart.quads.push_back(quad);
    const auto corner = [&](std::size_t k) { return chart.panel.positions[quad[k]]; };
    if ((corner(0) - corner(2)).length2() <= (corner(1) - corner(3)).length2()) {
      chart.panel.triangles.emplace_back(quad[0], quad[1], quad[2]);
      chart.panel.triangles.emplace_back(quad[0], quad[2], quad[3]);
    } else {
      chart.panel.triangles.emplace_back(quad[0], quad[1], quad[3]);
      chart.panel.triangles.emplace_back(quad[1], quad[2], quad[3]);
    }
  }
  return chart;
}

void move_to(Chart& chart, const std::vector<V3d>& positions) {
  for (std::size_t v = 0; v < chart.points.size(); ++v) {
    chart.panel.positions[v] = positions[chart.points[v]];
  }
}

void turn_to_grain(Chart& chart, const V3d& down, double middle_u) {
  const V2d grain =
      gradient_of(chart.panel, chart.plane, down).normalized();  // where `down` goes in the plane
  // (u, v up): `grain` shall become (0, -1); then v is turned to grow downwards.
  Imath::Box2d box;
  for (V2d& p : chart.plane) {
    p = V2d(p.y * grain.x - p.x * grain.y, p.x * grain.x + p.y * grain.y);
    box.extendBy(p);
  }
  const V2d origin((box.min.x + box.max.x) / 2 - middle_u, box.min.y);
  for (V2d& p : chart.plane) p -= origin;
}

Patch patch_of(const Chart& chart, const std::string& material) {
  return {material, chart.points, chart.plane, chart.panel.triangles};
}

}  // namespace selvedge::samples
