#include "converter/stitch/marching_cubes.h"

#include <cmath>
#include <cstdint>

namespace selvedge {
namespace {

/// The place along an edge, in (0, 1), where the function changes sign: regula falsi (Illinois), which keeps
/// its bracket.
template <class F>
double crossing(const F& function, double value0, double value1) {
  double low = 0;
  double high = 1;
  double f_low = value0;
  double f_high = value1;
  int last_side = 0;
  double s = 0.5;
  for (int i = 0; i < 60 && high - low > 1e-12; ++i) {
    s = low + (high - low) * (f_low / (f_low - f_high));
    if (!(s > low && s < high)) s = 0.5 * (low + high);
    const double f = function(s);
    if (std::abs(f) < 1e-12 * (std::abs(value0) + std::abs(value1))) break;
    if ((f < 0) == (value0 < 0)) {
      low = s;
      f_low = f;
      if (last_side == -1) f_high *= 0.5;
      last_side = -1;
    } else {
      high = s;
      f_high = f;
      if (last_side == 1) f_low *= 0.5;
      last_side = 1;
    }
  }
  return s < edge_margin ? edge_margin : (s > 1 - edge_margin ? 1 - edge_margin : s);
}

class Marcher {
 public:
  Marcher(const MarchingGrid& grid, const std::function<double(const V3d&)>& function)
      : grid_(grid),
        function_(function),
        step_(grid.period.x / grid.cells.x, grid.period.y / grid.cells.y, grid.z_step),
        index_(node(V3i(grid.cells.x, grid.cells.y, grid.cells.z)) * 3 + 3, -1) {}

  MarchedSurface run() {
    evaluate();
    for (int z = 0; z < grid_.cells.z; ++z) {
      for (int y = 0; y < grid_.cells.y; ++y) {
        for (int x = 0; x < grid_.cells.x; ++x) march_cube(V3i(x, y, z));
      }
    }
    return std::move(surface_);
  }

 private:
  std::size_t node(const V3i& grid_point) const {
    return (grid_point.z * (grid_.cells.y + 1) + grid_point.y) * (grid_.cells.x + 1) + grid_point.x;
  }

  V3i wrapped(const V3i& grid_point) const {
    return {grid_point.x == grid_.cells.x ? 0 : grid_point.x,
            grid_point.y == grid_.cells.y ? 0 : grid_point.y, grid_point.z};
  }

  V3d position(const V3i& grid_point) const {
    return {grid_point.x * step_.x, grid_point.y * step_.y, grid_.z_min + grid_point.z * step_.z};
  }

  void evaluate() {
    values_.resize(node(grid_.cells) + 1);
    for (int z = 0; z <= grid_.cells.z; ++z) {
      for (int y = 0; y <= grid_.cells.y; ++y) {
        for (int x = 0; x <= grid_.cells.x; ++x) {
          const V3i grid_point(x, y, z);
          const V3i original_node = wrapped(grid_point);
          values_[node(grid_point)] =
              original_node == grid_point ? function_(position(grid_point)) : values_[node(original_node)];
        }
      }
    }
  }

  /// The vertex on the edge from grid point `grid_point` along `axis`, created on first use.
  int vertex(const V3i& grid_point, int axis) {
    int& index = index_[node(grid_point) * 3 + axis];
    if (index >= 0) return index;
    const V3i original_node = wrapped(grid_point);
    if (original_node != grid_point) {
      const int original = vertex(original_node, axis);
      V3d copy = surface_.positions[original];
      if (grid_point.x != original_node.x) copy.x = grid_.period.x;
      if (grid_point.y != original_node.y) copy.y = grid_.period.y;
      index = add(copy, original);
      return index;
    }
    V3i end = grid_point;
    end[axis] += 1;
    const V3d start = position(grid_point);
    const auto place = [&](double s) {
      V3d p = start;
      p[axis] += s * step_[axis];
      return p;
    };
    const double s = crossing([&](double t) { return function_(place(t)); }, values_[node(grid_point)],
                              values_[node(end)]);
    index = add(place(s), static_cast<int>(surface_.positions.size()));
    return index;
  }

  int add(const V3d& position, int original) {
    surface_.positions.push_back(position);
    surface_.original.push_back(original);
    return static_cast<int>(surface_.positions.size()) - 1;
  }

  void march_cube(const V3i& grid_point) {
    const auto corner = [&](int c) { return grid_point + V3i(c & 1, c >> 1 & 1, c >> 2 & 1); };
    unsigned inside = 0;
    for (int c = 0; c < 8; ++c) {
      if (values_[node(corner(c))] < 0) inside |= 1U << c;
    }
    for (const std::array<int, 3>& edges : triangles_of(inside)) {
      V3i triangle;
      for (int k = 0; k < 3; ++k) {
        const int edge = edges[k];
        triangle[k] = vertex(corner(edge_corner(edge)), edge / 4);
      }
      surface_.triangles.push_back(triangle);
    }
  }

  const MarchingGrid& grid_;
  const std::function<double(const V3d&)>& function_;
  V3d step_;
  std::vector<double> values_;
  std::vector<int> index_;  ///< vertex of each edge, three per grid point; -1: none yet
  MarchedSurface surface_;
};

}  // namespace

MarchedSurface march(const MarchingGrid& grid, const std::function<double(const V3d&)>& function) {
  return Marcher(grid, function).run();
}

}  // namespace selvedge
