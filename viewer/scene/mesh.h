// Merges the surfaces of a scene into one mesh, projects it, and lists triangles by their place in a frame.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "format/simd/group.h"
#include "viewer/scene/material.h"
#include "viewer/scene/surfaces.h"

namespace selvedge {

struct MergedTriangle {
  std::array<std::uint32_t, 3> corners{};
  std::uint32_t surface = 0;
  float handedness = 1;             ///< w of the corners' tangents (surfaces.h)
  V2f whole_repeats{0, 0};          ///< repeats that their coordinates lack
  bool has_degenerate_uvs = false;  ///< Tangents::degenerate_uvs
  bool operator==(const MergedTriangle&) const = default;
};

struct MergedSurfaces {
  std::vector<V3f> positions;
  /// Two groups per vertex: normal and u; tangent and v.
  std::vector<std::array<Group, 2>> attributes;
  V3f normal(std::uint32_t vertex) const { return xyz(attributes[vertex][0]); }
  V3f tangent(std::uint32_t vertex) const { return xyz(attributes[vertex][1]); }
  V2f uv(std::uint32_t vertex, int mapping = 0) const {
    if (mapping > 0) return extra_uvs[mapping - 1][vertex];
    return {attributes[vertex][0][3], attributes[vertex][1][3]};
  }
  std::vector<MergedTriangle> triangles;  ///< in the order of the surfaces
  /// Surface::extra_uvs, [mapping - 1][vertex], and Surface::colors, [vertex]; (0, 0) and white for a surface
  /// without them, empty if all surfaces lack them.
  std::vector<std::vector<V2f>> extra_uvs;
  std::vector<V4f> colors;
  /// Whether all but positions, normals and tangents is the same.
  bool differs_by_shape(const MergedSurfaces& other) const {
    return triangles == other.triangles && extra_uvs == other.extra_uvs && colors == other.colors &&
           std::ranges::equal(attributes, other.attributes, [](const auto& a, const auto& b) {
             return a[0][3] == b[0][3] && a[1][3] == b[1][3];
           });
  }

 private:
  static V3f xyz(const Group& g) { return {g[0], g[1], g[2]}; }
};

/// A triangle as it is seen: twice its index in MergedSurfaces::triangles, + 1 for its back.
using TriangleSide = std::uint32_t;
inline constexpr TriangleSide no_triangle_side = ~TriangleSide{0};

/// Pixels that are looked up together.
inline constexpr std::size_t lane_count = 16;
using LaneFloats = std::array<float, lane_count>;

MergedSurfaces merge(std::span<const Surface> surfaces);

/// The triangles of one surface, which are consecutive in the mesh.
struct TriangleSpan {
  std::uint32_t surface = 0;
  std::size_t first = 0;
  std::size_t end = 0;
};
std::vector<TriangleSpan> spans_of(const MergedSurfaces& mesh);

/// The vertices projected to a frame of `width` x `height` pixels.
struct ProjectedVertices {
  int width = 1;
  int height = 1;
  std::vector<V4f> clip;  ///< OpenGL's clip space
  /// (X, Y, W, 0): the vertex lies at the pixel coordinates (width / 2 + X / W, height / 2 + Y / W), x to the
  /// right and y up; (0, 0) is the outer corner of the first pixel of the bottom row.
  std::vector<Group> screen;
};

/// `clip`: world -> clip (camera.h), for coordinates relative to the surfaces' origin.
ProjectedVertices project(const MergedSurfaces& mesh, const M44d& clip, int width, int height);

/// Triangles behind each other at a pixel, the mean over the frame. Parts beyond the frame do not count.
double mean_depth_complexity(const MergedSurfaces& mesh, const ProjectedVertices& projected);

/// Triangles by the visible side, front and back, in the order of the mesh.
using TriangleLists = std::array<std::vector<std::uint32_t>, 2>;

/// The triangles that may cover the centre of a pixel, for bands of `band_rows` rows each, from the bottom of
/// the frame. Triangles without area and culled backs are on no list.
std::vector<TriangleLists> list_bands(const MergedSurfaces& mesh, const ProjectedVertices& projected,
                                      std::span<const SurfaceMaterial> materials, int band_rows);

}  // namespace selvedge
