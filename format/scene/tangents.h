// Tangents per vertex from texture coordinates, for fabrics and for normal textures.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

/// The side from which a triangle's texture is seen, which decides whether it is mirrored.
enum class Facing {
  winding,  ///< the side on which the corners run counter-clockwise: MikkTSpace, and so TANGENT of glTF
  normals,  ///< the side of the normals, for any order of the corners
};

/// Tangents of the given vertices, followed by copies of vertices that need several tangents.
struct Tangents {
  /// xyz: unit, perpendicular to the normal; zero where u has no direction. w: +1 or -1.
  std::vector<V4f> tangents;
  std::vector<std::uint32_t> copy_sources;  ///< for each copy the given vertex
  std::vector<std::uint32_t> indices;       ///< the given ones, changed for triangles that use copies
  /// 1 for a triangle whose texture says nothing, without area, or so much denser or sparser than
  /// others' that it only shows streaks or noise.
  std::vector<std::uint8_t> degenerate_uvs;
};

/// The tangent of a vertex is dP/du of its triangles, weighted by their angles at the vertex and made
/// perpendicular to the normal, as in MikkTSpace: vertices with the same position, normal and texture
/// coordinates are one, and triangles at a vertex form a group if edges connect them and their textures are
/// all mirrored or all not. glTF's bitangent is cross(normal, tangent) * w and points up in the texture,
/// where v falls: a texture that is not mirrored has w = +1. Triangles without UV area are ignored,
/// and seen from the normals all that are streaked.
/// `normals`: unit or zero, one per position. `indices`: three per triangle, in range.
Tangents compute_tangents(std::span<const V3d> positions, std::span<const V3d> normals,
                          std::span<const V2d> tex_coords, std::span<const std::uint32_t> indices,
                          Facing facing);

}  // namespace selvedge
