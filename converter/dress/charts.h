// Cuts a surface into charts and lays them flat, for garments without texture coordinates.
#pragma once

#include <cstdint>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

/// How much cloth has to stretch on one triangle.
struct ChartStretch {
  double most = 1;  ///< the larger singular value of the map, or the inverse of the smaller
  double area = 0;  ///< m^2
};

struct Charts {
  int count = 0;
  std::vector<std::uint32_t> sources;  ///< of each new vertex, the vertex of the surface
  std::vector<V2d> uvs;  ///< of each new vertex: metres, v grows downwards, no two charts overlap
  std::vector<std::uint32_t>
      indices;                        ///< new vertices, three a triangle; triangles without area are left out
  std::vector<ChartStretch> stretch;  ///< of each triangle
};

/// Charts are parts whose normals, smoothed over some rounds of neighbours, lie nearest to the same half
/// axis: front, back, sides, top, bottom. A part of less than a hundredth of what it hangs together with
/// joins the neighbour with the longest common edge. Each is laid flat as rigidly as possible
/// (format/scene/flatten.h), or projected along its mean normal where that turns a triangle over or where it
/// has very many holes and handles, and turned so that `down` is v. Charts stand in rows at v >= `top`, which
/// moves below them. Vertices in one point count as one; an edge of more than two triangles, or of two that
/// face each other, is a seam. `positions`: metres; `triangles`: three vertices each, counter-clockwise seen
/// from outside.
Charts cut_into_charts(const std::vector<V3d>& positions, const std::vector<std::uint32_t>& triangles,
                       const V3d& down, double& top);

/// For each position the index of the first one in the same point.
std::vector<std::uint32_t> weld(const std::vector<V3d>& positions);

/// The stretch that this share of the area stays below; 1 without an area.
double stretch_below(std::vector<ChartStretch> stretch, double share);

}  // namespace selvedge
