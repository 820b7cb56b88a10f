#include <algorithm>
#include <bit>
#include <stdexcept>

#include "converter/stitch/marching_cubes.h"

namespace selvedge {
namespace {

constexpr int edge_count = 12;
using Triangle = std::array<int, 3>;

/// The edge between two neighbouring corners.
int edge_between(int a, int b) {
  const int lower = a & b;
  const int axis = std::countr_zero(static_cast<unsigned>(a ^ b));
  for (int e = axis * 4; e < axis * 4 + 4; ++e) {
    if (edge_corner(e) == lower) return e;
  }
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
bool share_face(int a, int b) {
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
    return side || !share_face(contour[a], contour[b]);
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
    if (!contour.empty() && !fill(contour, 0, contour.size() - 1, triangles)) {
      throw std::logic_error("a contour of Marching Cubes cannot be filled");
    }
  }
  return triangles;
}

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

}  // namespace selvedge
