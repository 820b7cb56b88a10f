// Materials of the scene as the index pass wants them.
#pragma once

#include <string>
#include <vector>

#include "format/image.h"
#include "format/scene.h"
#include "viewer/index_pass.h"

namespace selvedge {

/// A picture on a surface.
struct TextureLook {
  int image = -1;  ///< index into Looks::images; -1: none, a factor of 1
  int mapping =
      0;  ///< with which coordinates it is looked up: 0 SurfaceVertex::uv, k Surface::more_uvs[k - 1]
  Wrap wrap_u = Wrap::repeat;
  Wrap wrap_v = Wrap::repeat;
  bool nearest = false;
};

/// glTF's core material of a surface. On one with a fabric only occlusion and emission count. The first two
/// factors multiply the base colour: `SurfaceLook::base_color` and `image`, and Surface::colors.
struct CoreLook {
  TextureLook base_color;
  float metallic = 1;
  float roughness = 1;
  TextureLook metallic_roughness;  ///< linear; roughness in green, metal in blue
  TextureLook normal;              ///< linear, (n + 1) / 2
  float normal_scale = 1;
  TextureLook occlusion;  ///< linear, in red
  float occlusion_strength = 1;
  V3f emissive{0, 0, 0};  ///< linear radiance
  TextureLook emissive_texture;
  bool unlit = false;
};

struct Looks {
  std::vector<SurfaceLook> looks;  ///< one per surface
  std::vector<CoreLook> core;      ///< one per surface
  std::vector<Image> images;       ///< linear
};

/// Decodes the pictures that `surfaces` need; one that cannot be read is left out with a line in `remarks`.
/// A fabric is drawn on both sides, since cloth is thin and shows its back through its holes; glTF's
/// doubleSided and alphaMode hold for the materials without one. GLTF_REFERENCE where a fabric is not among
/// the `fabrics` given.
Result<Looks> looks_of(const Scene& scene, const std::vector<Surface>& surfaces, std::size_t fabrics,
                       std::vector<std::string>& remarks);

}  // namespace selvedge
