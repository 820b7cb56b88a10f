// Tangents per vertex from texture coordinates, for fabrics and for normal textures.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

/// Which side a triangle's picture is seen from, which decides between upright and mirrored.
enum class Facing {
  winding,  ///< the side on which its corners run counter-clockwise: MikkTSpace, and so TANGENT of glTF
  normals,  ///< the side of its normals, whichever way its corners run
};

/// The result: tangents for the old vertices and, behind them, for copies of those that need several.
struct Tangents {
  /// xyz: unit, perpendicular to the normal; zero where u has no direction. w: +1 or -1.
  std::vector<V4f> tangents;
  std::vector<std::uint32_t> copy_of;  ///< for each added vertex the old one it copies
  std::vector<std::uint32_t> indices;  ///< as given, but for the triangles that use copies
};

/// Tangent of a vertex: dP/du of its triangles, weighted by their angles at the vertex, made perpendicular to
/// the normal, as MikkTSpace does it: vertices with the same position, normal and texture coordinates are
/// one, and triangles at a vertex count together if edges connect them and their pictures are both upright or
/// both mirrored. The bitangent of glTF is cross(normal, tangent) * w and points up in the picture, where v
/// falls: an upright picture that is not mirrored has w = +1. Triangles without area in UV count for nothing.
/// `normals`: unit or zero, one per position. `indices`: three per triangle, in range.
Tangents compute_tangents(std::span<const V3d> positions, std::span<const V3d> normals,
                          std::span<const V2d> tex_coords, std::span<const std::uint32_t> indices,
                          Facing facing);

/// Some unit vector perpendicular to a unit normal, where nothing says which.
V3d any_perpendicular(const V3d& normal);

}  // namespace selvedge
