// Bakes a fabric into glTF's core material, for viewers that do not know the extension: as pictures and
// factors, and then as textures and material properties of a document.
#pragma once

#include <optional>

#include "format/fabric/fabric.h"
#include "format/gltf/document.h"
#include "format/picture/image.h"
#include "format/scene/scene.h"

namespace selvedge {

/// One repeat of the fabric as pictures, and factors. Metallic is 0, roughness 1, and there is no reflection
/// of dielectrics (KHR_materials_specular, specularFactor 0): beside the sheen it never makes the fit better.
/// Base colour and sheen are those with which the core formula comes nearest to the fabric from afar, over
/// all pairs of directions.
struct Fallback {
  /// Linear, RGBA. Colour: directional albedo along the normal, the integral of f(l, z) over the lights,
  /// times one factor a channel, so that its mean is the fitted colour, clamped to 1; holes have the mean
  /// colour, so that coarser mip levels have no dark rims. Alpha: alpha(z).
  Image base_color;
  /// The mean of that albedo over the cloth, as the fabric has it.
  V3f albedo{0, 0, 0};
  /// Data (not sRGB), RGB = (n + 1) / 2: x along growing u, y up in the picture, as in glTF's normal
  /// textures. Nothing if the fabric stores no frames.
  std::optional<Image> normal;
  /// As has_holes says (format/fabric/evaluate.h): alphaMode MASK, cutoff 0.5.
  bool holes = false;
  /// KHR_materials_sheen: most fabrics brighten towards the rim, and where light comes from the viewer's
  /// side. Zero if the fit does without.
  V3f sheen_color{0, 0, 0};
  float sheen_roughness = 0.6F;  ///< what fits the built-in stitches best
  /// KHR_materials_diffuse_transmission: the share of light from behind that comes through in the brightest
  /// channel, and its colour. The base colour makes up for the share. 0 for opaque cloth.
  float transmission = 0;
  V3f transmission_color{1, 1, 1};
};

/// The mean of the first three channels, weighted by alpha where there are four; black if alpha is 0
/// everywhere.
V3f mean_color(const Image& image);

/// Pictures have at most 1024 pixels a side: larger fabrics are baked from a coarser level. Precondition: a
/// valid fabric (see validate) with at least one level.
Fallback bake_fallback(const Fabric& fabric);

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
