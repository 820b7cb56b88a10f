// Draws a fabric for glTF's core material, for viewers that do not know the extension: a picture and factors,
// and then a texture and material properties of a document.
#pragma once

#include "converter/make/fallback_factors.h"
#include "format/fabric/fabric.h"
#include "format/gltf/document.h"
#include "format/picture/image.h"
#include "format/scene/scene.h"

namespace selvedge {

/// One repeat of the fabric as a picture, of the yarn itself where the fabric has it, and factors.
struct Fallback {
  /// Linear, RGBA. Colour: directional albedo along the normal, the integral of f(l, z) over the lights,
  /// times one factor a channel, so that its mean is the fitted base colour, clamped to 1; holes have the
  /// mean colour, so that coarser mip levels have no dark rims. Alpha: alpha(z).
  Image color;
  /// As has_holes says (format/fabric/evaluate.h): alphaMode MASK, cutoff 0.5.
  bool has_holes = false;
  FallbackFactors factors;
};

/// The index of an equal entry of a root array, or of this one, appended.
int find_or_add(Json& root, const char* array, const Json& entry);
/// The same of an embedded PNG.
int find_or_add_image(GltfDocument& document, const std::vector<std::uint8_t>& bytes, const char* name);

/// The mean of the first three channels, weighted by alpha where there are four; black if alpha is 0
/// everywhere.
V3f mean_color(const Image& image);

/// Pictures have at most 1024 pixels a side: larger fabrics are baked from a coarser level. Precondition: a
/// valid fabric (see validate) with at least one level.
Fallback bake_fallback(const Fabric& fabric);

/// Adds the picture as embedded PNG with a repeating, mip-mapped sampler, and returns the number of its
/// texture. An equal picture, sampler or texture in the document (after dressing twice) is used again.
Result<int> add_fallback_texture(GltfDocument& document, const Fallback& fallback);
/// The same of any linear picture.
Result<int> add_color_texture(GltfDocument& document, const Image& image, const char* title);

/// Removes a material's lobes, which a fallback replaces (emission stays); `unfit_alone`: those that may
/// not stand beside a fabric. Gives back their extensions.
std::vector<std::string> drop_lobes(GltfDocument& document, Json& material, bool unfit_alone = false);

/// Rewrites the core part of the material (dress.h says which members stay). The fabric's texture gets the
/// reference's UV set and transform. A tint texture or mask of the extension becomes the base colour texture,
/// times the fabric's mean colour; its normal texture becomes the fallback's, its tint a factor.
void set_fallback(GltfDocument& document, int material, const Fallback& fallback, int texture,
                  const FabricReference& reference);

}  // namespace selvedge
