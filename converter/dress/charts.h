// Cuts a surface into charts and lays them flat, for garments without texture coordinates.
#pragma once

#include <cstdint>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

struct Charts {
  int count = 0;
  std::vector<std::uint32_t> source_vertices;  ///< for each new vertex, the vertex of the surface
  std::vector<V2d> uvs;  ///< for each new vertex: metres, v grows downwards, no two charts overlap
  std::vector<std::uint32_t>
      indices;  ///< new vertices, three a triangle; triangles without area are left out
};

/// Charts are parts whose normals, smoothed over some rounds of neighbours, lie nearest to the same half
/// axis: front, back, sides, top, bottom. A part of less than a hundredth of what it hangs together with
/// joins the neighbour with the longest common edge. Each is laid flat as rigidly as possible (flatten.h), or
/// projected along its mean normal where that turns a triangle over or where it has very many holes and
/// handles, and turned so that `down` is v. Charts stand in rows at v >= `top`, which moves below them.
/// Vertices nearer to each other than 0.3 % of a triangle's size count as one. A triangle that
/// faces its neighbours' other way is laid as they are; those that would make the surface no two-manifold (a
/// third one at an edge, a twin) hang together among themselves. `positions`: metres; `triangles`: three
/// vertices each, counter-clockwise seen from outside.
Charts cut_into_charts(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles,
                       const V3d& down, double& top);

}  // namespace selvedge
