// Converts a scene to vertices for OpenGL: instances in world space, texture coordinates transformed and
// brought near zero, tangents along growing u.
#pragma once

#include <cstdint>
#include <vector>

#include "format/base/error.h"
#include "format/scene/scene.h"

namespace selvedge {

struct SurfaceVertex {
  V3f position;  ///< m, world axes, relative to the given origin
  V3f normal;    ///< unit, world
  /// xyz: unit, world, along dP/du after the material's texture transform; zero if u has no direction. w: +1
  /// if the texture is upright seen from the side of the normal, -1 if mirrored: the direction of falling v
  /// is w * (normal x tangent). For the fabric's coordinates, else for the normal texture's, where the file's
  /// own TANGENT takes precedence.
  V4f tangent;
  V2f uv;  ///< of mapping 0; without whole repeats of each chart, so that floats resolve the texels
  V2f whole_repeats{0, 0};  ///< these repeats
};

/// Texture coordinates of a picture or fabric: one set of the file under one transform.
struct Mapping {
  bool operator==(const Mapping&) const = default;
  int tex_coord = 0;
  UvTransform transform;
  Wrap wrap_u = Wrap::repeat;
  Wrap wrap_v = Wrap::repeat;
};

/// The different mappings of a material: first its fabric's, or else the base colour's, which is
/// SurfaceVertex::uv; then the other textures'. `index_of` returns the index of a mapping.
struct Mappings {
  std::vector<Mapping> list;
  /// Not 0: two more follow the list, from this number on. They hold the directions of growing u and of
  /// falling v of the normal texture in the plane of the fabric's frame, which are its x and y if there are
  /// none.
  int normal_frame = 0;
  int index_of(const Mapping& mapping) const;
};
Mapping mapping_of(const TextureReference& texture);
Mappings mappings_of(const SceneMaterial& material);

/// One instance of a primitive. Triangles are counter-clockwise seen from outside.
struct Surface {
  int material = -1;  ///< index into Scene::materials; -1: the default material of glTF
  std::vector<SurfaceVertex> vertices;
  std::vector<std::uint32_t> indices;
  /// Coordinates of mappings 1, 2 ..., and of Mappings::normal_frame; per vertex; empty without coordinates.
  std::vector<std::vector<V2f>> extra_uvs;
  std::vector<V4f> colors;                   ///< linear factors on the base colour; empty: white
  std::vector<std::uint8_t> degenerate_uvs;  ///< Tangents::degenerate_uvs of the fabric; empty: none
};

/// All instances. Tangents come from compute_tangents, in world space after the texture transform; a
/// vertex between mirrored and upright triangles is duplicated. (Derivatives in the fragment shader would
/// lose digits in close views of large coordinates, and show flat triangles in anisotropic highlights.) A
/// chart is a set of triangles connected by common vertices. Each chart is moved, in double, by whole repeats
/// to just above zero (by pairs of repeats with mirrored wrapping, not at all with clamping). GARMENT_NO_UVS
/// for a primitive that lacks the texture coordinates of its fabric; MESH_NOT_FINITE. Precondition: indices
/// and arrays of a primitive fit together, as read_scene() leaves them.
Result<std::vector<Surface>> build_surfaces(const Scene& scene, const V3d& origin);

}  // namespace selvedge
