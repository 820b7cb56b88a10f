// Points spread evenly over a cell's surface, a grid that finds neighbours in a periodic cell, and the balls
// that touch the surface from inside (the medial axis).
#pragma once

#include <cmath>
#include <cstdlib>
#include <optional>
#include <vector>

#include "converter/mesh/cell_mesh.h"

namespace selvedge {

struct SampledPoint {
  V3d position{0, 0, 0};  ///< mm, x and y within the cell
  V3d normal{0, 0, 1};    ///< unit, outward
  V3f albedo{0, 0, 0};
};

double surface_area(const CellMesh& mesh);

/// A place of the axis that repeats with `period`, in [0, period).
inline double wrap_to_repeat(double x, double period) {
  const double in_cell = x - std::floor(x / period) * period;
  return in_cell < period ? in_cell : 0;
}

/// At most `count` points that stand for equal fractions of the area. Points within a triangle follow its
/// vertex normals (Boubekeur and Alexa 2008, "Phong tessellation", with shape factor 1/2, for which an arc is
/// right to second order). Points without a normal are left out. Precondition: validate(mesh) holds.
std::vector<SampledPoint> sample_surface(const CellMesh& mesh, int count);

/// Finds points near a place, in all copies of the cell.
class PeriodicGrid {
 public:
  /// Cells are about `size` mm wide. Precondition: x and y of the points lie within the cell.
  PeriodicGrid(std::vector<V3d> points, const V2d& period, double size);

  /// Calls visit(index, offset from `place` to that copy of the point) for all within `reach` mm, and some
  /// further away, the nearer cells first. `visit` may lower `reach`.
  template <class Visit>
  void visit_near(const V3d& place, double& reach, const Visit& visit) const;

 private:
  std::vector<V3d> points_;
  V2d period_;
  V3d size_{1, 1, 1};
  V3i cells_{1, 1, 1};
  double low_ = 0;
  double min_size_ = 1;
  std::vector<int> start_;  ///< of each cell in order_
  std::vector<int> order_;
};

/// Radius of the largest ball that touches the surface in point `index` from inside (Ma et al. 2012, "3D
/// medial axis point approximation using nearest neighbors and the normal field"); empty if it is not below
/// `max_radius`. Neighbours seen at more than 60 degrees from the normal do not count: noise would make their
/// balls small. `grid` holds the positions of `points`.
std::optional<double> inner_radius(const std::vector<SampledPoint>& points, const PeriodicGrid& grid,
                                   int index, double max_radius);

template <class Visit>
void PeriodicGrid::visit_near(const V3d& place, double& reach, const Visit& visit) const {
  const V3i middle(static_cast<int>(std::floor(place.x / size_.x)),
                   static_cast<int>(std::floor(place.y / size_.y)),
                   static_cast<int>(std::floor((place.z - low_) / size_.z)));
  const auto repeat_of = [](int i, int count) { return i >= 0 ? i / count : -((count - 1 - i) / count); };
  const auto visit_cell = [&](int x, int y, int z) {
    const V2i repeat(repeat_of(x, cells_.x), repeat_of(y, cells_.y));
    const int cell = (z * cells_.y + y - repeat.y * cells_.y) * cells_.x + x - repeat.x * cells_.x;
    const V3d from = V3d(repeat.x * period_.x, repeat.y * period_.y, 0) - place;
    for (int k = start_[cell]; k < start_[cell + 1]; ++k) visit(order_[k], points_[order_[k]] + from);
  };
  for (int shell = 0; (shell - 1) * min_size_ < reach; ++shell) {
    for (int dz = -shell; dz <= shell; ++dz) {
      const int z = middle.z + dz;
      if (z < 0 || z >= cells_.z) continue;
      for (int dy = -shell; dy <= shell; ++dy) {
        const bool inside = std::abs(dz) < shell && std::abs(dy) < shell;
        for (int dx = -shell; dx <= shell; dx += inside ? 2 * shell : 1)
          visit_cell(middle.x + dx, middle.y + dy, z);
      }
    }
  }
}

}  // namespace selvedge
