#include "converter/dress/flatten.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Entry = Eigen::Triplet<double>;

/// A triangle of the panel in its own plane: first corner at the origin, first edge along +x.
struct FlatTriangle {
  std::array<Eigen::Vector2d, 3> corners;
  std::array<double, 3> cotangents;  ///< of the angle at each corner
};

std::vector<FlatTriangle> lay_flat(const Panel& panel) {
  std::vector<FlatTriangle> flat;
  flat.reserve(panel.triangles.size());
  for (const V3i& triangle : panel.triangles) {
    std::array<V3d, 3> p;
    for (int k = 0; k < 3; ++k) {
      p[k] = panel.positions[triangle[k]];
    }
    const V3d a = p[1] - p[0];
    const V3d b = p[2] - p[0];
    const double double_area = a.cross(b).length();
    FlatTriangle out;
    out.corners[0] = {0, 0};
    out.corners[1] = {a.length(), 0};
    out.corners[2] = {a.dot(b) / a.length(), double_area / a.length()};
    for (std::size_t k = 0; k < 3; ++k) {
      out.cotangents[k] = (p[(k + 1) % 3] - p[k]).dot(p[(k + 2) % 3] - p[k]) / double_area;
    }
    flat.push_back(out);
  }
  return flat;
}

std::size_t corner_of(const V3i& triangle, std::size_t k) {
  return static_cast<std::size_t>(triangle[static_cast<int>(k % 3)]);
}

/// The two vertices that are kept in place by the conformal map: the ends of the longest axis of the box.
std::array<std::size_t, 2> far_apart(const std::vector<V3d>& positions) {
  std::array<std::size_t, 2> best{0, 0};
  double length = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] =
        std::ranges::minmax_element(positions, [&](const V3d& a, const V3d& b) { return a[axis] < b[axis]; });
    if ((*high)[axis] - (*low)[axis] > length) {
      length = (*high)[axis] - (*low)[axis];
      best = {static_cast<std::size_t>(low - positions.begin()),
              static_cast<std::size_t>(high - positions.begin())};
    }
  }
  return best;
}

/// Least-squares conformal map: minimises Dirichlet energy minus area with two vertices held.
std::vector<V2d> conformal(const Panel& panel, const std::vector<FlatTriangle>& flat) {
  const std::size_t count = panel.positions.size();
  const std::array<std::size_t, 2> held = far_apart(panel.positions);
  std::vector<V2d> plane(count, V2d(0, 0));
  plane[held[1]] = V2d((panel.positions[held[1]] - panel.positions[held[0]]).length(), 0);

  std::vector<int> unknown(count, -1);
  int unknowns = 0;
  for (std::size_t v = 0; v < count; ++v) {
    if (v != held[0] && v != held[1]) unknown[v] = unknowns++;
  }
  std::vector<Entry> entries;
  entries.reserve(36 * flat.size());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(2 * unknowns);
  const auto add = [&](std::size_t row, int row_axis, std::size_t column, int column_axis, double value) {
    if (unknown[row] < 0) return;
    const int r = 2 * unknown[row] + row_axis;
    if (unknown[column] >= 0) {
      entries.emplace_back(r, 2 * unknown[column] + column_axis, value);
    } else {
      right[r] -= value * plane[column][column_axis];
    }
  };
  for (std::size_t t = 0; t < flat.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = corner_of(panel.triangles[t], k);
      const std::size_t j = corner_of(panel.triangles[t], k + 1);
      const double weight = 0.5 * flat[t].cotangents[(k + 2) % 3];
      for (int axis = 0; axis < 2; ++axis) {
        add(i, axis, i, axis, weight);
        add(j, axis, j, axis, weight);
        add(i, axis, j, axis, -weight);
        add(j, axis, i, axis, -weight);
      }
      // The area's part: -(u_i v_j - u_j v_i) / 2, whose inner edges cancel.
      add(i, 0, j, 1, -0.5);
      add(j, 1, i, 0, -0.5);
      add(j, 0, i, 1, 0.5);
      add(i, 1, j, 0, 0.5);
    }
  }
  Sparse matrix(2 * unknowns, 2 * unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  std::vector<Entry>().swap(entries);  // the factors need the room
  const Eigen::VectorXd solution = Eigen::SimplicialLDLT<Sparse>(matrix).solve(right);
  for (std::size_t v = 0; v < count; ++v) {
    if (unknown[v] >= 0) plane[v] = V2d(solution[2 * unknown[v]], solution[2 * unknown[v] + 1]);
  }
  double flat_area = 0;
  double plane_area = 0;
  for (std::size_t t = 0; t < flat.size(); ++t) {
    flat_area += flat[t].corners[1].x() * flat[t].corners[2].y();
    const V2d& a = plane[corner_of(panel.triangles[t], 0)];
    plane_area +=
        (plane[corner_of(panel.triangles[t], 1)] - a) % (plane[corner_of(panel.triangles[t], 2)] - a);
  }
  const double scale = std::sqrt(flat_area / plane_area);
  for (V2d& p : plane) p *= scale;
  return plane;
}

/// The rotation nearest to the map from the flat triangle to its place in the plane.
Eigen::Matrix2d nearest_rotation(const FlatTriangle& flat, const std::array<Eigen::Vector2d, 3>& plane) {
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    covariance += flat.cotangents[(k + 2) % 3] * (plane[next] - plane[k]) *
                  (flat.corners[next] - flat.corners[k]).transpose();
  }
  const double angle = std::atan2(covariance(1, 0) - covariance(0, 1), covariance(0, 0) + covariance(1, 1));
  return Eigen::Rotation2Dd(angle).toRotationMatrix();
}

/// As rigid as possible, from given plane positions.
std::vector<V2d> relax(const Panel& panel, const std::vector<FlatTriangle>& flat,
                       const std::vector<V2d>& start) {
  const Eigen::Index count = static_cast<Eigen::Index>(panel.positions.size());

  // The first vertex is held: the energy does not see translations.
  std::vector<Entry> entries{Entry(0, 0, 1.0)};
  for (std::size_t t = 0; t < flat.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int i = panel.triangles[t][static_cast<int>(k)];
      const int j = panel.triangles[t][static_cast<int>((k + 1) % 3)];
      const double weight = flat[t].cotangents[(k + 2) % 3];
      entries.emplace_back(i, i, weight);
      entries.emplace_back(j, j, weight);
      entries.emplace_back(i, j, -weight);
      entries.emplace_back(j, i, -weight);
    }
  }
  Sparse matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Sparse> solver(matrix);

  Eigen::MatrixX2d plane(count, 2);
  for (Eigen::Index v = 0; v < count; ++v) {
    const V2d& p = start[v];
    plane.row(v) << p.x, p.y;
  }
  constexpr int rounds = 40;
  for (int round = 0; round < rounds; ++round) {
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(count, 2);
    for (std::size_t t = 0; t < flat.size(); ++t) {
      const FlatTriangle& triangle = flat[t];
      const V3i& index = panel.triangles[t];
      const Eigen::Matrix2d rotation =
          nearest_rotation(triangle, {plane.row(index[0]), plane.row(index[1]), plane.row(index[2])});
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = (k + 1) % 3;
        const Eigen::Vector2d pull =
            triangle.cotangents[(k + 2) % 3] * rotation * (triangle.corners[k] - triangle.corners[next]);
        right.row(index[static_cast<int>(k)]) += pull.transpose();
        right.row(index[static_cast<int>(next)]) -= pull.transpose();
      }
    }
    right.row(0) += plane.row(0);
    plane = solver.solve(right);
  }
  std::vector<V2d> result(panel.positions.size());
  for (Eigen::Index v = 0; v < count; ++v) {
    result[v] = V2d(plane(v, 0), plane(v, 1));
  }
  return result;
}

}  // namespace

std::vector<V2d> flatten(const Panel& panel) {
  const std::vector<FlatTriangle> flat = lay_flat(panel);
  return relax(panel, flat, conformal(panel, flat));
}

V2d gradient_of(const Panel& panel, const std::vector<V2d>& plane, const V3d& direction) {
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

}  // namespace selvedge
