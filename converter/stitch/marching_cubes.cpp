#include "converter/stitch/marching_cubes.h"

#include <bit>
#include <cmath>
#include <stdexcept>

namespace selvedge {
namespace {

constexpr int edge_count = 12;
using Triangle = std::array<int, 3>;

/// The edge between two neighbouring corners.
int edge_between(int a, int b) {
  const int lower = a & b;
  const int axis = std::countr_zero(static_cast<unsigned>(a ^ b));
  for (int e = axis * 4; e < axis * 4 + 4; ++e)
    if (edge_corner(e) == lower) return e;
  return -1;
}

/// The corners of a face, counter-clockwise seen from outside of the cube.
std::array<int, 4> face_corners(int axis, int side) {
  const int u = 1 << ((axis + 1) % 3);
  const int v = 1 << ((axis + 2) % 3);
  const int base = side << axis;
  if (side == 1) return {base, base + u, base + u + v, base + v};
  return {base, base + v, base + u + v, base + u};
}

/// Whether both edges belong to one face of the cube.
bool have_common_face(int a, int b) {
  for (int axis = 0; axis < 3; ++axis) {
    if (a / 4 == axis || b / 4 == axis) continue;
    if (((edge_corner(a) ^ edge_corner(b)) >> axis & 1) == 0) return true;
  }
  return false;
}

/// From each crossed edge to the next one of its contour; -1 where an edge is not crossed. Each contour
/// goes around inside corners so that its triangles are counter-clockwise seen from outside.
std::array<int, edge_count> contours_of(unsigned inside) {
  std::array<int, edge_count> next;
  next.fill(-1);
  const auto is_inside = [&](int corner) { return (inside >> corner & 1U) != 0; };
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      const std::array<int, 4> corner = face_corners(axis, side);
      for (std::size_t k = 0; k < 4; ++k) {
        // From the begin of a run of inside corners the contour leads to its end.
        if (is_inside(corner[k]) || !is_inside(corner[(k + 1) % 4])) continue;
        std::size_t last = (k + 1) % 4;
        while (is_inside(corner[(last + 1) % 4])) last = (last + 1) % 4;
        next[edge_between(corner[k], corner[(k + 1) % 4])] =
            edge_between(corner[last], corner[(last + 1) % 4]);
      }
    }
  }
  return next;
}

/// Triangulates the part of the contour from `first` to `last`; false if that needs a diagonal within a face.
bool fill(const std::vector<int>& contour, std::size_t first, std::size_t last, std::vector<Triangle>& out) {
  if (last - first < 2) return true;
  const auto allowed = [&](std::size_t a, std::size_t b) {
    const bool side = b - a == 1 || (a == 0 && b == contour.size() - 1);
    return side || !have_common_face(contour[a], contour[b]);
  };
  for (std::size_t middle = first + 1; middle < last; ++middle) {
    if (!allowed(first, middle) || !allowed(middle, last)) continue;
    const std::size_t size_before = out.size();
    out.push_back({contour[first], contour[middle], contour[last]});
    if (fill(contour, first, middle, out) && fill(contour, middle, last, out)) return true;
    out.resize(size_before);
  }
  return false;
}

std::vector<Triangle> build_case(unsigned inside) {
  std::array<int, edge_count> next = contours_of(inside);
  std::vector<Triangle> triangles;
  for (std::size_t e = 0; e < edge_count; ++e) {
    std::vector<int> contour;
    for (auto edge = e; next[edge] >= 0;) {
      contour.push_back(static_cast<int>(edge));
      const std::size_t following = next[edge];
      next[edge] = -1;
      edge = following;
    }
    if (!contour.empty() && !fill(contour, 0, contour.size() - 1, triangles))
      throw std::logic_error("a contour of Marching Cubes cannot be filled");
  }
  return triangles;
}

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
    for (int z = 0; z < grid_.cells.z; ++z)
      for (int y = 0; y < grid_.cells.y; ++y)
        for (int x = 0; x < grid_.cells.x; ++x) march_cube(V3i(x, y, z));
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
    surface_.source_vertex.push_back(original);
    return static_cast<int>(surface_.positions.size()) - 1;
  }

  void march_cube(const V3i& grid_point) {
    const auto corner = [&](int c) { return grid_point + V3i(c & 1, c >> 1 & 1, c >> 2 & 1); };
    unsigned inside = 0;
    for (int c = 0; c < 8; ++c)
      if (values_[node(corner(c))] < 0) inside |= 1U << c;
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

int edge_corner(int edge) {
  const int axis = edge / 4;
  return (edge & 1) << ((axis + 1) % 3) | (edge >> 1 & 1) << ((axis + 2) % 3);
}

std::span<const std::array<int, 3>> triangles_of(unsigned inside) {
  static const std::vector<std::vector<Triangle>> cases = [] {
    std::vector<std::vector<Triangle>> all;
    for (unsigned c = 0; c < 256; ++c) all.push_back(build_case(c));
    return all;
  }();
  return cases[inside & 255U];
}

MarchedSurface marching_cubes(const MarchingGrid& grid, const std::function<double(const V3d&)>& function) {
  return Marcher(grid, function).run();
}

}  // namespace selvedge
