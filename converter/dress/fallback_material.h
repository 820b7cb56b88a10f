// A baked fallback as textures and material properties of a glTF document.
#pragma once

#include "converter/dress/fallback.h"
#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Textures in the document, and the factors beside them.
struct FallbackTextures {
  int base_color = -1;
  V3f mean{1, 1, 1};  ///< colour of the base colour texture
  int normal = -1;    ///< -1: the fabric has no normals
  bool holes = false;
  V3f sheen_color{0, 0, 0};
  float sheen_roughness = 0;
  float transmission = 0;
  V3f transmission_color{1, 1, 1};
};

/// Adds the pictures as embedded PNG with one repeating, mip-mapped sampler. Equal pictures, samplers and
/// textures in the document (after dressing twice) are reused.
Result<FallbackTextures> add_fallback_textures(GltfDocument& document, const Fallback& fallback);

/// Rewrites the core part of the material (dress.h says which members stay). The fabric's textures get the
/// reference's UV set and transform. Where the extension has a tint texture or a mask, that is the base
/// colour texture, times the fabric's mean colour; its normal texture is that of the fallback; its tint is a
/// factor.
void set_fallback(GltfDocument& document, int material, const FallbackTextures& textures,
                  const FabricReference& reference);

}  // namespace selvedge
