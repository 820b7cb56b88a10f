#include "samples/panels.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
  V2d grain(0, 0);  // where `down` goes in the plane, weighted by area
  for (const V3i& t : chart.panel.triangles) {
    const std::size_t i = static_cast<std::size_t>(t[0]);
    const std::size_t j = static_cast<std::size_t>(t[1]);
    const std::size_t k = static_cast<std::size_t>(t[2]);
    const V3d p = chart.panel.positions[j] - chart.panel.positions[i];
    const V3d q = chart.panel.positions[k] - chart.panel.positions[i];
    const V2d a = chart.plane[j] - chart.plane[i];
    const V2d b = chart.plane[k] - chart.plane[i];
    // The gradient of `down . P` over the plane, times the doubled area.
    const double along_p = down.dot(p);
    const double along_q = down.dot(q);
    grain += V2d(along_p * b.y - along_q * a.y, along_q * a.x - along_p * b.x);
  }
  grain.normalize();
  // (u, v up): `grain` shall become (0, -1); then v is turned to grow downwards.
  double low_u = std::numeric_limits<double>::max();
  double high_u = std::numeric_limits<double>::lowest();
  double low_v = low_u;
  for (V2d& p : chart.plane) {
    p = V2d(p.y * grain.x - p.x * grain.y, p.x * grain.x + p.y * grain.y);
    low_u = std::min(low_u, p.x);
    high_u = std::max(high_u, p.x);
    low_v = std::min(low_v, p.y);
  }
  const V2d origin((low_u + high_u) / 2 - middle_u, low_v);
  for (V2d& p : chart.plane) p -= origin;
}

Patch patch_of(const Chart& chart, const std::string& material) {
  return {material, chart.points, chart.plane, chart.panel.triangles};
}

}  // namespace selvedge::samples
