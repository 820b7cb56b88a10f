// All surfaces of a scene as one mesh, and where its triangles land in a frame.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "format/scene/camera.h"
#include "viewer/scene/material.h"
#include "viewer/scene/packed_fabric.h"
#include "viewer/scene/surfaces.h"

namespace selvedge {

struct MergedTriangle {
  std::array<std::uint32_t, 3> corners{};
  std::uint32_t surface = 0;
  float handedness = 1;  ///< w of the corners' tangents (surfaces.h)
};

struct MergedSurfaces {
  std::vector<V3f> positions;
  /// Two groups a vertex: normal and u; tangent and v.
  std::vector<std::array<Group, 2>> attributes;
  std::vector<MergedTriangle> triangles;  ///< in the order of the surfaces
  /// Surface::more_uvs and Surface::colors of all, [mapping - 1][vertex] and [vertex]; (0, 0) and white where
  /// a surface has none, empty where none has.
  std::vector<std::vector<V2f>> more_uvs;
  std::vector<V4f> colors;
};

MergedSurfaces merge(std::span<const Surface> surfaces);

/// Triangles of one surface, which lie side by side in the mesh.
struct TriangleSpan {
  std::uint32_t surface = 0;
  std::size_t first = 0;
  std::size_t end = 0;
};
std::vector<TriangleSpan> spans_of(const MergedSurfaces& mesh);

/// Three vertices for each triangle, as an index buffer wants them.
std::vector<std::uint32_t> corners_of(const MergedSurfaces& mesh);

/// The vertices in a frame of `width` x `height` pixels.
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

/// Which parts of a frame are of interest: squares of `tile_side` pixels, all of them where `tiles` is empty.
inline constexpr int tile_side = 8;
struct FrameTiles {
  int first_row = 0;
  int rows = 1;
  std::vector<std::uint8_t> tiles;  ///< [row / tile_side][x / tile_side], rows counted from first_row
};

/// Triangles by the side that is seen, in the order of the mesh.
struct TriangleLists {
  std::vector<std::uint32_t> front;
  std::vector<std::uint32_t> back;
};

/// Those that may cover the centre of a pixel in the tiles. Triangles without area are on neither list, nor
/// are backs that are not drawn.
TriangleLists list_triangles(const MergedSurfaces& mesh, const ProjectedVertices& projected,
                             std::span<const SurfaceMaterial> materials, const FrameTiles& where);

/// The same for bands of `band_rows` rows each, from the bottom of the frame.
std::vector<TriangleLists> list_bands(const MergedSurfaces& mesh, const ProjectedVertices& projected,
                                      std::span<const SurfaceMaterial> materials, int band_rows);

/// Those of a list that may still, for other tiles.
std::vector<std::uint32_t> sift_triangles(const MergedSurfaces& mesh, const ProjectedVertices& projected,
                                          std::span<const std::uint32_t> list, const FrameTiles& where);

}  // namespace selvedge
