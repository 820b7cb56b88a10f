// What a garment's material keeps when it gets a fabric, and what it loses.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "format/base/vec.h"
#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

struct KeepOptions {
  bool base_color = false;       ///< the base colour tints the fabric
  std::optional<V3f> tint = {};  ///< linear, instead of that of the base colour
  std::uint64_t memory = default_memory;
};

/// One line each, such as "normalTexture".
struct KeptParts {
  std::vector<std::string> kept;
  std::vector<std::string> replaced;
  std::vector<std::string> warnings;
};

/// Writes the members of the extension beside `fabric` to a material that is about to be dressed: the mask of
/// a picture with alpha, as a picture of alpha alone unless the base colour is kept, the normal texture, and
/// the tint. Of a material with a fabric they stay, as its core is a fallback, but for a tint that is given.
/// `scene`: as the document was read.
Result<KeptParts> keep_parts(GltfDocument& document, int material, const Scene& scene,
                             const KeepOptions& options);

/// What messages call the picture of a material's base colour. Precondition: it has one.
std::string picture_name(const Scene& scene, const SceneMaterial& material);

/// Whether the picture is more than one colour with light and shade, at the vertices that have the material.
bool is_print(const Scene& scene, int material);

}  // namespace selvedge
