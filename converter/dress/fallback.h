// Bakes a fabric into glTF's core material, for viewers that do not know the extension.
#pragma once

#include <optional>

#include "format/fabric/fabric.h"
#include "format/picture/image.h"

namespace selvedge {

/// One repeat of the fabric as pictures, and factors. Metallic is 0 and roughness 1: the normals hold the
/// fabric's relief, and its remaining gloss is too weak for a lobe.
struct Fallback {
  /// Linear, RGBA. Colour: directional albedo along the normal, the integral of f(l, z) over the lights,
  /// clamped to 1; holes have the mean colour, so that coarser mip levels have no dark rims. Alpha: alpha(z).
  Image base_color;
  /// Data (not sRGB), RGB = (n + 1) / 2: x along growing u, y up in the picture, as in glTF's normal
  /// textures. Nothing if the fabric stores no frames.
  std::optional<Image> normal;
  /// As has_holes says (format/fabric/evaluate.h): alphaMode MASK, cutoff 0.5.
  bool holes = false;
  /// KHR_materials_sheen: how much more light the fabric reflects towards 75 degrees than along the normal,
  /// averaged over texels and four azimuths, divided by the reflection of the extension's Charlie lobe of
  /// `sheen_roughness` and colour 1. Zero if the fabric does not brighten towards the rim.
  V3f sheen_color{0, 0, 0};
  float sheen_roughness = 0.5F;
};

struct FallbackOptions {
  int largest_side = 1024;  ///< of the pictures; larger fabrics are baked from a coarser level
  int lights = 256;         ///< directions of the integral
};

/// The mean of the first three channels, weighted by alpha where there are four; black if alpha is 0
/// everywhere.
V3f mean_color(const Image& image);

/// Precondition: a valid fabric (see validate) with at least one level.
Fallback bake_fallback(const Fabric& fabric, const FallbackOptions& options = {});

}  // namespace selvedge
