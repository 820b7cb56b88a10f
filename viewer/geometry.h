// The scene turned into vertices that OpenGL can draw: instances placed in the world, texture coordinates
// transformed and brought near zero, tangents along growing u.
#pragma once

#include <cstdint>
#include <vector>

#include "format/error.h"
#include "format/scene.h"

namespace selvedge {

struct SurfaceVertex {
  V3f position;  ///< m, world axes, relative to the origin that was asked for
  V3f normal;    ///< unit, world
  /// xyz: unit, along dP/du after the material's texture transform, world; zero where u has no direction.
  /// w: +1 where the texture is seen upright from the side of the normal, -1 where it is mirrored: the
  /// direction of falling v is w * (normal x tangent).
  V4f tangent;
  V2f uv;  ///< transformed; whole repeats taken off per primitive, so that float keeps the texels apart
};

/// One instance of a primitive. Triangles are counter-clockwise seen from outside.
struct Surface {
  int material = -1;  ///< index into Scene::materials; -1: the default material of glTF
  std::vector<SurfaceVertex> vertices;
  std::vector<std::uint32_t> indices;
};

/// The corners of all drawn triangles in the world, m, some of them repeatedly: at least three.
/// GARMENT_EMPTY, MESH_INVALID or MESH_NOT_FINITE.
Result<std::vector<V3d>> world_points(const Scene& scene);

/// All instances. The tangent of a vertex is the mean of its triangles' dP/du, weighted by their angle at the
/// vertex; a vertex between mirrored and upright triangles is doubled. (Derivatives in the fragment shader
/// would need no vertices, but lose their digits in close views of large coordinates, and make every flat
/// triangle show in an anisotropic highlight.)
/// GARMENT_NO_UVS for a primitive with a fabric and without the texture coordinates it names; MESH_INVALID
/// or MESH_NOT_FINITE for arrays that do not fit together.
Result<std::vector<Surface>> build_surfaces(const Scene& scene, const V3d& origin);

}  // namespace selvedge
