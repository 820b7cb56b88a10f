#include "converter/dress/flatten.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <map>
#include <set>

namespace selvedge {
namespace {

/// A place in the plane, x + iy.
using Complex = std::complex<double>;

/// A triangle of the panel in its own plane: first corner at the origin, first edge along +x.
struct FlatTriangle {
  std::array<int, 3> vertices;
  std::array<Complex, 3> corners;
  std::array<double, 3> cotangents;  ///< of the angle at each corner
};

std::vector<FlatTriangle> lay_flat(const ClothPanel& panel) {
  std::vector<FlatTriangle> flat;
  for (const V3i& t : panel.triangles) {
    const std::array<V3d, 3> p{panel.positions[t.x], panel.positions[t.y], panel.positions[t.z]};
    const V3d a = p[1] - p[0];
    const V3d b = p[2] - p[0];
    const double double_area = a.cross(b).length();
    FlatTriangle& out = flat.emplace_back();
    out.vertices = {t.x, t.y, t.z};
    out.corners = {0, a.length(), {a.dot(b) / a.length(), double_area / a.length()}};
    for (std::size_t k = 0; k < 3; ++k)
      out.cotangents[k] = (p[(k + 1) % 3] - p[k]).dot(p[(k + 2) % 3] - p[k]) / double_area;
  }
  return flat;
}

/// Calls visit(triangle, k, next, cotangent) for the three edges of each triangle, from corner k to `next`.
template <class Visit>
void for_each_edge(const std::vector<FlatTriangle>& flat, const Visit& visit) {
  for (const FlatTriangle& t : flat)
    for (std::size_t k = 0; k < 3; ++k) visit(t, k, (k + 1) % 3, t.cotangents[(k + 2) % 3]);
}

template <class Scalar>
Eigen::SimplicialLDLT<Eigen::SparseMatrix<Scalar>> factor(std::vector<Eigen::Triplet<Scalar>> entries,
                                                          Eigen::Index count) {
  Eigen::SparseMatrix<Scalar> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  std::vector<Eigen::Triplet<Scalar>>().swap(entries);  // the factors need the room
  return Eigen::SimplicialLDLT<Eigen::SparseMatrix<Scalar>>(matrix);
}

/// The two vertices that are kept in place by the conformal map: the ends of the longest axis of the box.
std::array<std::ptrdiff_t, 2> far_apart(const std::vector<V3d>& positions) {
  std::array<std::ptrdiff_t, 2> best{0, 0};
  double length = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] =
        std::ranges::minmax_element(positions, [&](const V3d& a, const V3d& b) { return a[axis] < b[axis]; });
    if ((*high)[axis] - (*low)[axis] <= length) continue;
    length = (*high)[axis] - (*low)[axis];
    best = {low - positions.begin(), high - positions.begin()};
  }
  return best;
}

/// Least-squares conformal map: minimises Dirichlet energy minus area with two vertices held.
Eigen::VectorXcd conformal(const std::vector<V3d>& positions, const std::vector<FlatTriangle>& flat) {
  const auto count = static_cast<Eigen::Index>(positions.size());
  const auto [first, second] = far_apart(positions);
  Eigen::VectorXcd right = Eigen::VectorXcd::Zero(count);
  right[second] = (positions[second] - positions[first]).length();
  const Eigen::VectorXcd held = right;
  std::vector<Eigen::Triplet<Complex>> entries{{static_cast<int>(first), static_cast<int>(first), 1.0},
                                               {static_cast<int>(second), static_cast<int>(second), 1.0}};
  const auto add = [&, first = first, second = second](int row, int column, const Complex& value) {
    if (row == first || row == second) return;
    if (column == first || column == second)
      right[row] -= value * held[column];
    else
      entries.emplace_back(row, column, value);
  };
  double flat_area = 0;
  for_each_edge(flat, [&](const FlatTriangle& t, std::size_t k, std::size_t next, double cotangent) {
    const int i = t.vertices[k];
    const int j = t.vertices[next];
    add(i, i, 0.5 * cotangent);
    add(j, j, 0.5 * cotangent);
    // The imaginary part is the area's, whose inner edges cancel.
    add(i, j, {-0.5 * cotangent, 0.5});
    add(j, i, {-0.5 * cotangent, -0.5});
    flat_area += (std::conj(t.corners[k]) * t.corners[next]).imag();
  });
  const Eigen::VectorXcd plane = factor(std::move(entries), count).solve(right);
  double plane_area = 0;
  for_each_edge(flat, [&](const FlatTriangle& t, std::size_t k, std::size_t next, double) {
    plane_area += (std::conj(plane[t.vertices[k]]) * plane[t.vertices[next]]).imag();
  });
  return plane * std::sqrt(flat_area / plane_area);
}

/// As rigid as possible, from given plane positions.
void relax(const std::vector<FlatTriangle>& flat, Eigen::VectorXcd& plane) {
  // The first vertex is held: the energy does not see translations.
  std::vector<Eigen::Triplet<double>> entries{{0, 0, 1.0}};
  for_each_edge(flat, [&](const FlatTriangle& t, std::size_t k, std::size_t next, double cotangent) {
    const int i = t.vertices[k];
    const int j = t.vertices[next];
    entries.emplace_back(i, i, cotangent);
    entries.emplace_back(j, j, cotangent);
    entries.emplace_back(i, j, -cotangent);
    entries.emplace_back(j, i, -cotangent);
  });
  const auto solver = factor(std::move(entries), plane.size());
  constexpr int rounds = 40;
  for (int round = 0; round < rounds; ++round) {
    // The rotation nearest to the map from each flat triangle to its place in the plane.
    std::vector<Complex> turns(flat.size());
    for_each_edge(flat, [&](const FlatTriangle& t, std::size_t k, std::size_t next, double cotangent) {
      turns[&t - flat.data()] += cotangent * (plane[t.vertices[next]] - plane[t.vertices[k]]) *
                                 std::conj(t.corners[next] - t.corners[k]);
    });
    for (Complex& turn : turns) turn = turn == 0.0 ? 1.0 : turn / std::sqrt(std::norm(turn));  // no hypot()
    Eigen::VectorXcd right = Eigen::VectorXcd::Zero(plane.size());
    right[0] = plane[0];
    for_each_edge(flat, [&](const FlatTriangle& t, std::size_t k, std::size_t next, double cotangent) {
      const Complex pull = cotangent * turns[&t - flat.data()] * (t.corners[k] - t.corners[next]);
      right[t.vertices[k]] += pull;
      right[t.vertices[next]] -= pull;
    });
    plane.real() = solver.solve(right.real().eval());
    plane.imag() = solver.solve(right.imag().eval());
  }
}

}  // namespace

std::vector<V2d> flatten(const ClothPanel& panel) {
  const std::vector<FlatTriangle> flat = lay_flat(panel);
  Eigen::VectorXcd plane = conformal(panel.positions, flat);
  relax(flat, plane);
  std::vector<V2d> result;
  for (const Complex& place : plane) result.emplace_back(place.real(), place.imag());
  return result;
}

V2d area_weighted_gradient(const ClothPanel& panel, const std::vector<V2d>& plane, const V3d& direction) {
  V2d sum(0, 0);
  for (const V3i& t : panel.triangles) {
    const V2d a = plane[t[1]] - plane[t[0]];
    const V2d b = plane[t[2]] - plane[t[0]];
    const double along_a = (panel.positions[t[1]] - panel.positions[t[0]]).dot(direction);
    const double along_b = (panel.positions[t[2]] - panel.positions[t[0]]).dot(direction);
    const double side = a % b < 0 ? -1 : 1;
    sum += side * V2d(along_a * b.y - along_b * a.y, along_b * a.x - along_a * b.x);
  }
  return sum;
}

std::vector<std::uint32_t> weld(const std::vector<V3d>& positions, double tolerance) {
  using Cell = std::array<double, 3>;
  const double side = tolerance > 0 ? 4 * tolerance : 1e-9;
  const auto cell_of = [&](const V3d& p) {
    return Cell{std::floor(p.x / side), std::floor(p.y / side), std::floor(p.z / side)};
  };
  std::multimap<Cell, std::uint32_t> cells;  // with the first ones
  std::vector<std::uint32_t> first;
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    std::set<Cell> around;
    for (const unsigned corner : {0U, 1U, 2U, 3U, 4U, 5U, 6U, 7U}) {
      const V3d way(corner & 1U ? 1 : -1, corner & 2U ? 1 : -1, corner & 4U ? 1 : -1);
      around.insert(cell_of(positions[i] + tolerance * way));
    }
    first.push_back(i);
    for (const Cell& cell : around) {
      for (auto [at, end] = cells.equal_range(cell); at != end; ++at) {
        const V3d away = positions[at->second] - positions[i];
        if (std::max({std::abs(away.x), std::abs(away.y), std::abs(away.z)}) <= tolerance)
          first[i] = std::min(first[i], at->second);
      }
    }
    if (first[i] == i) cells.emplace(cell_of(positions[i]), i);
  }
  return first;
}

}  // namespace selvedge
