// Members that a garment's material keeps or loses when it gets a fabric.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "format/base/vec.h"
#include "format/gltf/document.h"
#include "format/gltf/materials.h"
#include "format/scene/scene.h"

namespace selvedge {

/// The colour of the fabric: the garment's base colour, texture, factor and vertex colours, or one of the
/// others in its place.
struct ColorOptions {
  bool keeps_base_color = true;   ///< white and 0.8, which programs write by default, are no colour
  std::optional<V3f> color = {};  ///< linear, the mean of the cloth
  std::optional<V3f> tint = {};   ///< a factor on the fabric's reflectance
};

/// One line each, such as "normalTexture".
struct KeptMaterialMembers {
  std::vector<std::string> kept;
  std::vector<std::string> replaced;
  std::vector<std::string> warnings;
};

/// Writes the members of the extension beside `fabric` to a material that is about to be dressed: the mask of
/// a picture with alpha, as a picture of alpha alone unless the base colour is kept, the normal texture, and
/// the tint, by which cloth of mean `albedo` gets the garment's colour. Vertex colours stay, too, unless
/// another colour is wanted. Textures that are broken or on UV sets that the `places` of the material lack
/// are left out, with a warning, and so is alpha that is not cut. Of a material with a fabric they stay, as
/// its core is a fallback, but for a tint that is given. `scene`: as the document was read.
Result<KeptMaterialMembers> keep_material_members(GltfDocument& document, int material, const Scene& scene,
                                                  const std::set<PrimitiveIndex>& places,
                                                  const ColorOptions& options, const V3f& albedo);

}  // namespace selvedge
