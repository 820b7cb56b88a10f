// A glTF scene as plain data: what `dress` measures and what the viewer draws.
//
// Read from glTF by gltf_scene.h. Lengths are metres, +y is up, matrices follow Imath's row-vector
// convention (p' = p * M). Texture coordinates are kept in double because garments repeat a fabric
// thousands of times.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "format/vec.h"

namespace selvedge {

/// KHR_texture_transform: uv' = offset + R(rotation) * (scale * uv), rotation as the extension defines it.
struct UvTransform {
  V2d offset{0, 0};
  double rotation = 0;  ///< radians, counter-clockwise in the extension's sense
  V2d scale{1, 1};
  V2d apply(const V2d& uv) const;
  /// The 2x2 Jacobian applied to a vector in uv space (no offset).
  V2d apply_linear(const V2d& uv) const;
};

struct TextureReference {
  int image = -1;  ///< index into Scene::images; -1: none
  int tex_coord = 0;
  UvTransform transform;
};

struct FabricReference {
  int fabric = 0;  ///< index into Scene::fabrics
  int tex_coord = 0;
  UvTransform transform;
};

enum class AlphaMode { opaque, mask, blend };

struct SceneMaterial {
  std::string name;
  V4f base_color{1, 1, 1, 1};  ///< linear
  TextureReference base_color_texture;
  AlphaMode alpha_mode = AlphaMode::opaque;
  float alpha_cutoff = 0.5F;
  bool double_sided = false;
  std::optional<FabricReference> fabric;
};

/// Triangles with one material, in the mesh's own coordinates.
struct ScenePrimitive {
  std::string name;  ///< "mesh name/primitive index"
  int mesh = 0;      ///< where it stands in the file: /meshes/mesh/primitives/index
  int index = 0;
  int material = -1;
  std::vector<V3f> positions;
  std::vector<V3f> normals;                    ///< empty where the file has none
  std::vector<V4f> tangents;                   ///< xyz + handedness; empty where the file has none
  std::array<std::vector<V2d>, 2> tex_coords;  ///< TEXCOORD_0 and _1; empty where the file has none
  std::vector<std::uint32_t> indices;          ///< three per triangle; strips and fans are expanded
};

struct SceneInstance {
  int primitive = 0;
  M44d world;  ///< primitive -> world, metres
};

/// An encoded picture (PNG, JPEG) in memory.
struct SceneImage {
  std::string name;
  std::string mime_type;
  std::vector<std::uint8_t> bytes;
};

/// Where a fabric file is: beside the glTF, or inside of it.
struct SceneFabric {
  std::string name;
  std::string path;                 ///< external: resolved against the glTF's folder; empty if embedded
  std::vector<std::uint8_t> bytes;  ///< embedded: the whole EXR file
};

struct Scene {
  std::string file;
  std::vector<ScenePrimitive> primitives;
  std::vector<SceneInstance> instances;
  std::vector<SceneMaterial> materials;
  std::vector<SceneImage> images;
  std::vector<SceneFabric> fabrics;
  std::vector<std::string> remarks;  ///< what the file has and we do not read, one line each
};

}  // namespace selvedge
