// Colourways of a dressed garment: variants of KHR_materials_variants.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "format/base/vec.h"
#include "format/gltf/document.h"
#include "format/gltf/materials.h"

namespace selvedge {

/// A variant of the garment in which dressed materials have another colour or another fabric.
struct Colourway {
  std::string name;
  std::optional<V3f> color = {};  ///< linear, the mean of the cloth
  std::string fabric = {};        ///< a file, instead of a colour
};

/// Adds a variant to the document's and returns its index. OPTION_OUT_OF_RANGE if one has the name already.
Result<int> add_material_variant(GltfDocument& document, const std::string& name);

/// Copies a material under the name "<its own> <variant's>" and returns the index of the copy. In the
/// variant, places that wear the material by default show the copy; -1, and no copy, without such a place.
int copy_for_variant(GltfDocument& document, int material, const std::set<PrimitiveIndex>& places,
                     int variant);

/// Luminance of the blackest cloth (CIE L* 20): a dye leaves the gloss of the fibres, in which the weave
/// shows.
inline constexpr float min_cloth_luminance = 0.03F;

/// Returns the factor on the reflectance of a fabric that gives it `color` on average, at most max_tint; a
/// darker colour than min_cloth_luminance gets as much grey as it lacks. `albedo` is the fabric's own mean.
V3f tint_for_color(const V3f& color, const V3f& albedo);

}  // namespace selvedge
