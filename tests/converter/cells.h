// Simple cells with known closed forms, and what is measured on a mesh. Shared by the tests of the converter.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "converter/mesh/cell_mesh.h"
#include "converter/stitch/flat_yarn.h"
#include "converter/stitch/pattern.h"

namespace selvedge::testing {

/// A straight segment with evenly spread control points.
inline BezierSegment line(const V3d& a, const V3d& b) {
  return {a, a + (b - a) * (1.0 / 3), a + (b - a) * (2.0 / 3), b};
}

/// One straight yarn along x through the middle of a square cell.
inline StitchPattern cylinder(double period, double radius) {
  StitchPattern pattern{"cylinder", {period, period}, {}};
  pattern.yarns.push_back(
      {"y", radius, {0.5F, 0.25F, 0.125F}, {line({0, period / 2, 0}, {period, period / 2, 0})}});
  return pattern;
}

/// A ring about the cell's middle, axis along z: `count` Bézier arcs with the usual handle length, off a true
/// circle by less than 1e-9 of its radius for 32 arcs.
inline StitchPattern ring(double period, double ring_radius, double radius, int count = 32) {
  StitchPattern pattern{"ring", {period, period}, {}};
  Yarn yarn{"ring", radius, {0.5F, 0.5F, 0.5F}, {}};
  const double step = 2 * std::numbers::pi / count;
  const double handle = 4.0 / 3 * std::tan(step / 4) * ring_radius;
  const V3d centre(period / 2, period / 2, 0);
  for (int i = 0; i < count; ++i) {
    const double a = i * step;
    const double b = (i + 1) * step;
    const V3d p = centre + V3d(std::cos(a), std::sin(a), 0) * ring_radius;
    const V3d q = centre + V3d(std::cos(b), std::sin(b), 0) * ring_radius;
    yarn.segments.push_back({p, p + V3d(-std::sin(a), std::cos(a), 0) * handle,
                             q - V3d(-std::sin(b), std::cos(b), 0) * handle, q});
  }
  pattern.yarns.push_back(yarn);
  return pattern;
}

/// Where two yarns cross in the plane of the cloth, the second one in all its copies nearby.
struct Crossing {
  V2d at;
  double z_a;
  double z_b;
};

inline std::vector<Crossing> crossings_of(const StitchPattern& pattern, const Yarn& a, const Yarn& b) {
  // One period, from points off the ends of segments, where crossings like to lie.
  const auto points_of = [](const Yarn& yarn) {
    std::vector<V3d> points;
    for (const BezierSegment& segment : yarn.segments)
      for (int k = 0; k < 4; ++k) points.push_back(point_at(segment, (k + 0.37) / 4));
    points.push_back(points.front() + yarn.segments.back()[3] - yarn.segments.front()[0]);
    return points;
  };
  const std::vector<V3d> of_a = points_of(a);
  const std::vector<V3d> of_b = points_of(b);
  std::vector<Crossing> found;
  for (int sy = -2; sy <= 2; ++sy) {
    for (int sx = -2; sx <= 2; ++sx) {
      const V3d shift(sx * pattern.period_mm.x, sy * pattern.period_mm.y, 0);
      for (std::size_t i = 0; i + 1 < of_a.size(); ++i) {
        const V3d along_a = of_a[i + 1] - of_a[i];
        for (std::size_t j = 0; j + 1 < of_b.size(); ++j) {
          const V3d along_b = of_b[j + 1] - of_b[j];
          const V3d between = of_b[j] + shift - of_a[i];
          const double area = along_a.x * along_b.y - along_a.y * along_b.x;
          if (area == 0) continue;
          const double s = (between.x * along_b.y - between.y * along_b.x) / area;
          const double t = (between.x * along_a.y - between.y * along_a.x) / area;
          if (s < 0 || s >= 1 || t < 0 || t >= 1) continue;
          const V3d at = of_a[i] + along_a * s;
          found.push_back({V2d(at.x, at.y), at.z, of_b[j].z + along_b.z * t});
        }
      }
    }
  }
  return found;
}

inline V3d corner(const CellMesh& mesh, std::size_t triangle, int k) {
  return V3d(mesh.positions[mesh.triangles[triangle][k]]);
}

inline V3d twice_area(const CellMesh& mesh, std::size_t t) {
  return (corner(mesh, t, 1) - corner(mesh, t, 0)).cross(corner(mesh, t, 2) - corner(mesh, t, 0));
}

inline double area_of(const CellMesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += 0.5 * twice_area(mesh, t).length();
  return sum;
}

/// Volume inside by the divergence theorem for the field (0, 0, z): cuts at upright walls add nothing.
inline double volume_of(const CellMesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double z = (corner(mesh, t, 0).z + corner(mesh, t, 1).z + corner(mesh, t, 2).z) / 3;
    sum += 0.5 * twice_area(mesh, t).z * z;
  }
  return sum;
}

/// The surface as it repeats. Vertices are one where their positions are the same bits.
struct Topology {
  std::size_t vertices = 0;
  std::size_t edges = 0;
  std::size_t faces = 0;
  std::size_t unpaired = 0;  ///< directed edges without an opposite, whole periods away
  std::size_t repeated = 0;  ///< directed edges used by more than one triangle
  std::size_t components = 0;
  long euler() const {
    return static_cast<long>(vertices) - static_cast<long>(edges) + static_cast<long>(faces);
  }
};

inline Topology topology_of(const CellMesh& mesh) {
  std::map<std::array<float, 3>, int> ids;
  std::vector<V3d> places;
  std::map<std::pair<int, int>, int> directed;
  Topology result;
  std::vector<std::array<int, 3>> triangles;
  for (const V3i& t : mesh.triangles) {
    auto& corners = triangles.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const V3f& p = mesh.positions[t[k]];
      const auto [found, added] = ids.try_emplace({p.x, p.y, p.z}, static_cast<int>(places.size()));
      if (added) places.emplace_back(p);
      corners[k] = found->second;
    }
  }
  std::vector<int> root(places.size());
  for (std::size_t i = 0; i < root.size(); ++i) root[i] = static_cast<int>(i);
  const auto find = [&](int i) {
    while (root[i] != i) i = root[i];
    return i;
  };
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (++directed[{t[k], t[(k + 1) % 3]}] > 1) ++result.repeated;
      const int a = find(t[k]);
      const int b = find(t[(k + 1) % 3]);
      root[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<std::pair<int, int>> open;
  for (const auto& [edge, uses] : directed) {
    const bool paired = directed.contains({edge.second, edge.first});
    if (!paired) open.push_back(edge);
    if (!paired || edge.first < edge.second) ++result.edges;
  }
  const auto is_copy = [&](int a, int b) {
    V3d off = places[a] - places[b];
    for (int k = 0; k < 2; ++k) off[k] -= std::round(off[k] / mesh.period[k]) * mesh.period[k];
    return off.length() < 1e-5;
  };
  for (const auto& edge : open)
    result.unpaired += std::ranges::count_if(open, [&](const auto& other) {
                         return is_copy(edge.first, other.second) && is_copy(edge.second, other.first);
                       }) != 1;
  result.vertices = places.size();
  result.faces = triangles.size();
  for (std::size_t i = 0; i < root.size(); ++i) result.components += root[i] == static_cast<int>(i);
  return result;
}

/// From a point to the nearest yarn's surface, mm, of flat yarn in its round section; negative inside.
/// Precondition: no swells.
inline double distance_to_yarns(const StitchPattern& pattern, const V3d& point) {
  double least = 1e9;
  for (const Yarn& yarn : pattern.yarns) {
    const double thin = yarn.squeezes.empty() ? yarn.flattening : 0.3;
    for (std::size_t i = 0; i < yarn.segments.size(); ++i) {
      for (const CurveSpan& span : spans_of(yarn.segments[i], 0.5 * yarn.radius_mm, 0.02 * yarn.radius_mm)) {
        V3d near = point - (span.start + span.end) * 0.5;
        for (int k = 0; k < 2; ++k)
          near[k] -= std::round(near[k] / pattern.period_mm[k]) * pattern.period_mm[k];
        for (int copy = 0; copy < 9; ++copy) {
          const V3d way =
              near + V3d((copy % 3 - 1) * pattern.period_mm.x, (copy / 3 - 1) * pattern.period_mm.y, 0);
          const double beyond = way.length() - 0.5 * (span.end - span.start).length() - span.sag;
          if (beyond * thin - yarn.radius_mm >= least) continue;
          const V3d place = way + (span.start + span.end) * 0.5;
          const double t = nearest_parameter(yarn.segments[i], span.t0, span.t1, place);
          const V3d squeeze = squeeze_at(yarn, i, t);
          least = std::min(least, squeezed(place - point_at(yarn.segments[i], t), squeeze).length() -
                                      round_section_radius(yarn.radius_mm, squeeze));
        }
      }
    }
  }
  return least;
}

}  // namespace selvedge::testing
