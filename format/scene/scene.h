// A glTF scene as plain data, read by format/gltf/read_scene.h, measured by `dress` and drawn by the viewer.
//
// Lengths are metres, +y is up, matrices follow Imath's row-vector convention (p' = p * M). Texture
// coordinates are double because garments repeat a fabric thousands of times.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/base/memory.h"
#include "format/base/vec.h"

namespace selvedge {

/// KHR_texture_transform: uv' = offset + R(rotation) * (scale * uv), rotation as the extension defines it.
struct UvTransform {
  V2d offset{0, 0};
  double rotation = 0;  ///< radians, counter-clockwise in the extension's sense
  V2d scale{1, 1};
  V2d apply(const V2d& uv) const;
  /// Applies the 2x2 Jacobian to a vector in uv space (no offset).
  V2d apply_linear(const V2d& uv) const;
  bool operator==(const UvTransform&) const = default;
};

/// Continuation of a texture beyond [0, 1].
enum class Wrap { repeat, mirror, clamp };

struct TextureReference {
  bool operator==(const TextureReference&) const = default;
  int image = -1;  ///< index into Scene::images; -1: none
  int tex_coord = 0;
  UvTransform transform;
  Wrap wrap_u = Wrap::repeat;
  Wrap wrap_v = Wrap::repeat;
  bool has_nearest_filter = false;  ///< magnified without interpolation
};

struct FabricReference {
  bool operator==(const FabricReference&) const = default;
  int fabric = 0;  ///< index into Scene::fabrics
  int tex_coord = 0;
  UvTransform transform;
};

/// Textures of the garment that stay visible with the fabric: members of the extension.
struct GarmentTextures {
  bool operator==(const GarmentTextures&) const = default;
  TextureReference mask;     ///< in alpha
  float mask_cutoff = 0.5F;  ///< the surface is not there where the mask is less
  TextureReference normal;   ///< linear, bends the fabric's frame
  float normal_scale = 1;
  V3f tint{1, 1, 1};  ///< linear factor on the fabric's reflectance, times the texture
  TextureReference tint_texture;
};

enum class AlphaMode { opaque, mask, blend };

/// glTF's core material and the fabric of the extension. Factors multiply the textures.
struct SceneMaterial {
  bool operator==(const SceneMaterial&) const = default;
  std::string name;
  V4f base_color{1, 1, 1, 1};  ///< linear
  TextureReference base_color_texture;
  float metallic = 1;
  float roughness = 1;
  TextureReference metallic_roughness_texture;  ///< linear; roughness in green, metal in blue
  TextureReference normal_texture;              ///< linear
  float normal_scale = 1;
  TextureReference occlusion_texture;  ///< linear, in red
  float occlusion_strength = 1;
  V3f emissive{0, 0, 0};  ///< linear, KHR_materials_emissive_strength included
  TextureReference emissive_texture;
  bool unlit = false;  ///< KHR_materials_unlit: the base colour is displayed without lighting
  AlphaMode alpha_mode = AlphaMode::opaque;
  float alpha_cutoff = 0.5F;
  bool double_sided = false;
  std::optional<FabricReference> fabric;
  GarmentTextures garment_textures;  ///< with a fabric
};

/// Triangles with one material, in the mesh's coordinates, or for a skinned mesh in the world's. Morph
/// targets are applied with their default weights.
struct ScenePrimitive {
  std::string name;  ///< "mesh name/primitive index"
  int mesh = 0;      ///< the primitive is /meshes/mesh/primitives/index in the file
  int primitive_index = 0;
  int material = -1;
  std::vector<int> variant_materials;  ///< `material` in each of Scene::variants
  std::vector<V3f> positions;
  std::vector<V3f> normals;                    ///< this and the next three: empty if the file has none
  std::vector<V4f> tangents;                   ///< xyz + handedness
  std::array<std::vector<V2d>, 2> tex_coords;  ///< TEXCOORD_0 and TEXCOORD_1
  std::vector<V4f> colors;                     ///< COLOR_0, linear, factors on the base colour or the tint
  std::vector<std::uint32_t> indices;          ///< three per triangle; strips and fans are expanded
};

struct SceneInstance {
  int primitive = 0;
  M44d world;  ///< primitive -> world, metres
};

/// An encoded picture (PNG, JPEG, WebP) in memory.
struct SceneImage {
  std::string name;
  std::string mime_type;
  std::vector<std::uint8_t> bytes;
};

/// A fabric file, external or embedded in the glTF.
struct SceneFabric {
  std::string name;
  std::string path;                 ///< external: resolved against the glTF's folder; empty if embedded
  std::vector<std::uint8_t> bytes;  ///< embedded: the whole EXR file
};

enum class LightKind { directional, point, spot };

/// A light of KHR_lights_punctual.
struct SceneLight {
  std::string name;
  LightKind kind = LightKind::directional;
  V3f color{1, 1, 1};       ///< linear
  float intensity = 1;      ///< directional: lux; point and spot: candela
  double range = 0;         ///< m; 0: no end
  double inner_cone = 0;    ///< spot: half angles in radians, full intensity within ...
  double outer_cone = 0;    ///< ... and 0 outside
  V3d position{0, 0, 0};    ///< m, world
  V3d direction{0, 0, -1};  ///< unit, world, away from the light
};

/// A camera of the file; it looks along -z of its axes, +y is up.
struct SceneCamera {
  std::string name;
  bool is_perspective = true;
  double yfov = 1;               ///< perspective: vertical field of view, radians
  std::optional<double> aspect;  ///< perspective: width : height, if the file has it
  V2d half_size{1, 1};           ///< orthographic: half width and half height, m
  double znear = 0;              ///< m
  std::optional<double> zfar;    ///< m; empty: infinite
  M44d world;                    ///< camera -> world, scales included
};

struct Scene {
  std::string file;
  std::vector<ScenePrimitive> primitives;
  std::vector<SceneInstance> instances;
  std::vector<SceneMaterial> materials;
  std::vector<SceneImage> images;
  std::vector<SceneFabric> fabrics;
  std::vector<SceneLight> lights;
  std::vector<SceneCamera> cameras;
  double front_azimuth = 0;                          ///< azimuth that it faces, degrees: 180 of VRM 0, else 0
  std::vector<std::string> variants;                 ///< names, one for each of the file
  std::vector<std::string> remarks;                  ///< features of the file that are ignored, one line each
  std::uint64_t memory_left = default_memory_limit;  ///< bytes for its fabrics and textures (base/memory.h)
};

/// Whether no coordinate exceeds 10^9: squares of areas beyond overflow floats.
bool is_in_coordinate_range(const V3d& place);

/// World positions (m) of all vertices that triangles use. GARMENT_EMPTY without triangles, MESH_NOT_FINITE
/// unless all are near, in their primitives also; MESH_INVALID.
Result<std::vector<V3d>> world_points(const Scene& scene);

}  // namespace selvedge
