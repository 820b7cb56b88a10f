// A baked fallback as textures and material properties of a glTF document.
#pragma once

#include "converter/dress/fallback.h"
#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// The pictures of a fallback as textures of the document.
struct FallbackTextures {
  int base_color = -1;
  int normal = -1;  ///< -1: the fabric has no normals
};

/// Adds the pictures as embedded PNG with one repeating, mip-mapped sampler. Equal pictures, samplers and
/// textures in the document (after dressing twice) are reused.
Result<FallbackTextures> add_fallback_textures(GltfDocument& document, const Fallback& fallback);

/// Rewrites the core part of the material (dress.h says which members stay). The fabric's textures get the
/// reference's UV set and transform. A tint texture or mask of the extension becomes the base colour texture,
/// times the fabric's mean colour; its normal texture becomes the fallback's, its tint a factor.
void set_fallback(GltfDocument& document, int material, const Fallback& fallback,
                  const FallbackTextures& textures, const FabricReference& reference);

}  // namespace selvedge
