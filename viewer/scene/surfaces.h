// The scene turned into vertices that OpenGL can draw: instances placed in the world, texture coordinates
// transformed and brought near zero, tangents along growing u.
#pragma once

#include <cstdint>
#include <vector>

#include "format/base/error.h"
#include "format/scene/scene.h"
#include "format/scene/scene_points.h"

namespace selvedge {

struct SurfaceVertex {
  V3f position;  ///< m, world axes, relative to the origin that was asked for
  V3f normal;    ///< unit, world
  /// xyz: unit, along dP/du after the material's texture transform, world; zero where u has no direction.
  /// w: +1 where the texture is seen upright from the side of the normal, -1 where it is mirrored: the
  /// direction of falling v is w * (normal x tangent). Of the fabric's coordinates, else of the normal
  /// texture's, where the file's own TANGENT comes first.
  V4f tangent;
  V2f uv;  ///< of mapping 0; whole repeats taken off per chart, so that float keeps the texels apart
};

/// Texture coordinates as the picture or fabric is looked up with: one set of the file under one transform.
struct Mapping {
  int tex_coord = 0;
  UvTransform transform;
  Wrap wrap_u = Wrap::repeat;
  Wrap wrap_v = Wrap::repeat;
};

/// All mappings of a material, each once: of its fabric, or, without one, of the base colour, then of the
/// other textures. The first is SurfaceVertex::uv. `number_of` says which one a texture is looked up with.
struct Mappings {
  std::vector<Mapping> list;
  int number_of(const Mapping& mapping) const;
};
Mapping mapping_of(const TextureReference& texture);
Mappings mappings_of(const SceneMaterial& material);

/// One instance of a primitive. Triangles are counter-clockwise seen from outside.
struct Surface {
  int material = -1;  ///< index into Scene::materials; -1: the default material of glTF
  std::vector<SurfaceVertex> vertices;
  std::vector<std::uint32_t> indices;
  std::vector<std::vector<V2f>>
      more_uvs;             ///< of mappings 1, 2 ...: one per vertex; empty without coordinates
  std::vector<V4f> colors;  ///< linear factors on the base colour; empty: white
};

/// All instances. Tangents are those of compute_tangents, in the world and after the texture transform; a
/// vertex between mirrored and upright triangles is doubled. (Derivatives in the fragment shader would need
/// no vertices, but lose their digits in close views of large coordinates, and make every flat triangle show
/// in an anisotropic highlight.) A chart is what triangles connect by common vertices. In double, each is
/// moved by whole repeats to just above zero (by pairs of them where the picture is mirrored, not at all
/// where it ends). GARMENT_NO_UVS for a primitive with a fabric and without the texture coordinates it names;
/// MESH_INVALID or MESH_NOT_FINITE for arrays that do not fit together.
Result<std::vector<Surface>> build_surfaces(const Scene& scene, const V3d& origin);

}  // namespace selvedge
