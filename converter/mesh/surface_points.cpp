#include "converter/mesh/surface_points.h"

#include <algorithm>
#include <array>

namespace selvedge {
namespace {

double area_of(const CellMesh& mesh, const V3i& t) {
  const V3d p(mesh.positions[t.x]);
  return 0.5 * (V3d(mesh.positions[t.y]) - p).cross(V3d(mesh.positions[t.z]) - p).length();
}

/// The point of a triangle with these weights of its vertices; a zero normal if it has none.
SampledPoint point_in(const CellMesh& mesh, const V3i& t, const std::array<double, 3>& weights) {
  SampledPoint point;
  V3d flat(0, 0, 0);
  V3d normal(0, 0, 0);
  for (int k = 0; k < 3; ++k) {
    const int v = t[k];
    const double w = weights[k];
    flat += V3d(mesh.positions[v]) * w;
    normal += V3d(mesh.normals[v]) * w;
  }
  point.position = flat;
  for (int k = 0; k < 3; ++k) {
    const V3d n(mesh.normals[t[k]]);
    point.position -= n * (0.5 * weights[k] * (flat - V3d(mesh.positions[t[k]])).dot(n));
  }
  point.position.x = wrap_to_repeat(point.position.x, mesh.period.x);
  point.position.y = wrap_to_repeat(point.position.y, mesh.period.y);
  point.normal = normal.normalized();
  // Faces between touching yarns of two colours have no colour between them.
  const auto nearest = std::ranges::max_element(weights) - weights.begin();
  point.albedo = mesh.albedo[t[static_cast<int>(nearest)]];
  return point;
}

}  // namespace

double surface_area(const CellMesh& mesh) {
  double area = 0;
  for (const V3i& t : mesh.triangles) area += area_of(mesh, t);
  return area;
}

std::vector<SampledPoint> sample_surface(const CellMesh& mesh, int count) {
  std::vector<SampledPoint> points;
  points.reserve(count);
  const double each = surface_area(mesh) / count;
  double before = 0;
  std::size_t drawn = 0;
  for (const V3i& t : mesh.triangles) {
    const double area = area_of(mesh, t);
    for (; (static_cast<double>(drawn) + 0.5) * each < before + area; ++drawn) {
      // Additive recurrence with the plastic number: evenly spread also over a few large triangles.
      const double part = static_cast<double>(drawn + 1);
      const double a = wrap_to_repeat(part * 0.7548776662466927, 1);
      const double b = wrap_to_repeat(part * 0.5698402909980532, 1);
      const double side = std::sqrt(a);
      const SampledPoint point = point_in(mesh, t, {1 - side, side * (1 - b), side * b});
      if (point.normal.length2() > 0.5) points.push_back(point);
    }
    before += area;
  }
  return points;
}

PeriodicGrid::PeriodicGrid(std::vector<V3d> points, const V2d& period, double size)
    : points_(std::move(points)), period_(period) {
  constexpr double max_cells = 1 << 22;
  double high = 0;
  if (!points_.empty()) {
    const auto [low, top] =
        std::ranges::minmax_element(points_, [](const V3d& a, const V3d& b) { return a.z < b.z; });
    low_ = low->z;
    high = top->z;
  }
  const V3d extent(period.x, period.y, high - low_);
  const auto count = [&](int k) { return std::max(1.0, std::floor(extent[k] / size)); };
  while (count(0) * count(1) * count(2) > max_cells) size *= 1.5;
  for (int k = 0; k < 3; ++k) {
    cells_[k] = static_cast<int>(count(k));
    size_[k] = k == 2 ? std::max(size, extent[k] / cells_[k]) : extent[k] / cells_[k];
  }
  min_size_ = std::min({size_.x, size_.y, size_.z});
  std::vector<int> cell(points_.size());
  start_.assign(static_cast<std::size_t>(cells_.x) * cells_.y * cells_.z + 1, 0);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const V3d from = points_[i] - V3d(0, 0, low_);
    V3i at;
    for (int k = 0; k < 3; ++k) at[k] = std::min(cells_[k] - 1, static_cast<int>(from[k] / size_[k]));
    cell[i] = (at.z * cells_.y + at.y) * cells_.x + at.x;
    ++start_[cell[i] + 1];
  }
  for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
  order_.resize(points_.size());
  std::vector<int> next(start_.begin(), start_.end() - 1);
  for (std::size_t i = 0; i < points_.size(); ++i) order_[next[cell[i]]++] = static_cast<int>(i);
}

std::optional<double> inner_radius(const std::vector<SampledPoint>& points, const PeriodicGrid& grid,
                                   int index, double max_radius) {
  const V3d place = points[index].position;
  const V3d normal = points[index].normal;
  double radius = max_radius;
  double reach = 2 * radius;
  grid.visit_near(place, reach, [&](int other, const V3d& offset) {
    const double depth = -offset.dot(normal);
    const double length2 = offset.length2();
    if (depth <= 0 || length2 >= 4 * depth * depth || length2 >= 2 * depth * radius) return;
    if (offset.dot(points[other].normal) <= 0) return;  // the outside of other yarn
    radius = length2 / (2 * depth);
    reach = 2 * radius;
  });
  return radius < max_radius ? std::optional(radius) : std::nullopt;
}

}  // namespace selvedge
