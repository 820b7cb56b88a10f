// Tangents per vertex from texture coordinates, for normal textures.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "format/vec.h"

namespace selvedge {

/// The result: tangents for the old vertices and, behind them, for copies of those at which charts of
/// opposite handedness meet.
struct Tangents {
  std::vector<V4f> tangents;           ///< unit, perpendicular to the normal; w is +1 or -1
  std::vector<std::uint32_t> copy_of;  ///< for each added vertex the old one it copies
  std::vector<std::uint32_t> indices;  ///< as given, but for the triangles that use copies
};

/// Tangent of a vertex: dP/du of its triangles, weighted by their angles at the vertex, made perpendicular to
/// the normal (as MikkTSpace does, but with the given vertex sharing; vertices whose triangles have different
/// signs are split). The bitangent of glTF is cross(normal, tangent) * w and points up in the picture, where
/// v falls: an upright picture that is not mirrored has w = +1. Triangles without area in UV count for
/// nothing; a vertex with nothing else gets some unit tangent with w = +1.
/// `normals`: unit, one per position. `indices`: three per triangle, in range.
Tangents compute_tangents(std::span<const V3f> positions, std::span<const V3f> normals,
                          std::span<const V2d> tex_coords, std::span<const std::uint32_t> indices);

}  // namespace selvedge
