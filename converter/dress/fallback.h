// What viewers that do not know fabrics show instead: a fabric baked into glTF's core material.
#pragma once

#include <optional>

#include "format/fabric/fabric.h"
#include "format/picture/image.h"

namespace selvedge {

/// One repeat of the fabric as pictures, and the numbers beside them. Metallic is 0 and roughness 1: the
/// fabric's relief is in the normals, and what is left of a gloss is not worth a lobe.
struct Fallback {
  /// Linear, RGBA. Colour: directional albedo towards a viewer who looks straight down, that is the integral
  /// of f(l, z) over the lights, clamped to 1; a hole takes the mean colour, so that smaller mip levels have
  /// no dark rims. Alpha: alpha(z).
  Image base_color;
  /// Data (not sRGB), RGB = (n + 1) / 2: x along growing u, y up in the picture, as glTF's normal textures.
  /// Nothing if the fabric stores no frames.
  std::optional<Image> normal;
  /// As has_holes says (format/fabric/evaluate.h): alphaMode MASK, cutoff 0.5.
  bool holes = false;
  /// KHR_materials_sheen: how much more light the fabric sends towards views at 75 degrees than straight up,
  /// as a mean over its texels and four azimuths, divided by what the extension's Charlie lobe of
  /// `sheen_roughness` and colour 1 sends there. Zero where the fabric does not brighten towards the rim.
  V3f sheen_color{0, 0, 0};
  float sheen_roughness = 0.5F;
};

struct FallbackOptions {
  int largest_side = 1024;  ///< of the pictures; larger fabrics are baked from a coarser level
  int lights = 256;         ///< directions of the integral
};

/// The mean of the first three channels, weighted by alpha where there are four; black where all is open.
V3f mean_color(const Image& image);

/// Precondition: a valid fabric (see validate) with at least one level.
Fallback bake_fallback(const Fabric& fabric, const FallbackOptions& options = {});

}  // namespace selvedge
