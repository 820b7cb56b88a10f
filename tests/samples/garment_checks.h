// Measures of the sample garment.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "format/scene/flatten.h"
#include "samples/assembly.h"

namespace selvedge::samples {

/// Shares of a garment's area.
struct Measured {
  double area = 0;      ///< m^2
  double kept = 0;      ///< both singular values within 10 % of 1
  double mirrored = 0;  ///< u to the right and v upwards, or the other way round
  double largest = 1;   ///< singular value or its inverse
};

inline Measured measure(const Assembly& assembly, const std::string& material) {
  Measured m;
  for (const Patch& patch : assembly.patches) {
    if (patch.material != material) continue;
    for (const V3i& t : patch.triangles) {
      std::array<V3d, 3> corners;
      std::array<V2d, 3> plane;
      for (int k = 0; k < 3; ++k) {
        const std::size_t v = static_cast<std::size_t>(t[k]);
        corners[k] = assembly.points[patch.points[v]];
        plane[k] = patch.tex_coords[v];
      }
      const double area = (corners[1] - corners[0]).cross(corners[2] - corners[0]).length() / 2;
      const Stretch stretch = stretch_of(corners, plane);
      m.area += area;
      if (stretch.most < 1.1 && stretch.least > 0.9) m.kept += area;
      if ((plane[1] - plane[0]) % (plane[2] - plane[0]) >= 0) m.mirrored += area;
      m.largest = std::max({m.largest, stretch.most, 1 / stretch.least});
    }
  }
  return m;
}

/// The number of boundary loops of the surface that the patches form together.
inline int count_boundary_loops(const Assembly& assembly) {
  std::set<std::pair<int, int>> edges;
  for (const Patch& patch : assembly.patches) {
    for (const V3i& t : patch.triangles) {
      for (int k = 0; k < 3; ++k) {
        edges.emplace(patch.points[t[k]], patch.points[t[(k + 1) % 3]]);
      }
    }
  }
  std::map<int, int> next;
  for (const auto& [from, to] : edges) {
    if (!edges.contains({to, from})) next[from] = to;
  }
  int loops = 0;
  while (!next.empty()) {
    ++loops;
    int point = next.begin()->first;
    for (auto found = next.find(point); found != next.end(); found = next.find(point)) {
      point = found->second;
      next.erase(found);
    }
  }
  return loops;
}

/// The same, bit by bit.
inline bool same(const Assembly& a, const Assembly& b) {
  if (a.points != b.points || a.patches.size() != b.patches.size()) return false;
  for (std::size_t i = 0; i < a.patches.size(); ++i) {
    if (a.patches[i].points != b.patches[i].points || a.patches[i].tex_coords != b.patches[i].tex_coords ||
        a.patches[i].triangles != b.patches[i].triangles) {
      return false;
    }
  }
  return true;
}

}  // namespace selvedge::samples
