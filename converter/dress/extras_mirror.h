// What a material's extras remember of its fabric, for the day when a tool has dropped the extension
// (spec/SELVEDGE_materials_fabric, "Mirror in extras").
#pragma once

#include <optional>
#include <string>

#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// How a texture lies on the surface.
struct Placement {
  int tex_coord = 0;
  UvTransform transform;
};

struct Mirror {
  Placement fabric;
  std::optional<Placement> base_color;  ///< that of the core material then; nothing: it had no such texture
  std::string name;                     ///< of the fabric's entry; may be empty
  std::string uri;                      ///< relative to the glTF; empty: the fabric was embedded
  std::string digest;                   ///< see digest_of_fabric; empty where the mirror has none
};

/// Adds to the mirror that set_fabric_reference has written: the fabric's digest, and where the base colour
/// texture lies if that is elsewhere than the fabric. To be called when the core material is complete. Extras
/// that are not an object have no mirror and are left alone.
void complete_mirror(GltfDocument& document, int material, const std::string& digest);

/// The material's mirror, or nothing. GLTF_EXTENSION if there is one that cannot be understood.
Result<std::optional<Mirror>> read_mirror(const GltfDocument& document, int material);

/// Where the material's base colour texture lies; nothing if it has none.
std::optional<Placement> base_color_placement(const GltfDocument& document, int material);

/// Where the fabric has to lie now. An optimiser that has coded the texture coordinates anew has changed the
/// transform of the base colour texture to match, from mirror.base_color to `base_color`; the same change is
/// made to the fabric's. Nothing if that cannot be told: no base colour texture then or now, another UV set
/// than the fabric's, a changed rotation, a scale of zero.
std::optional<Placement> placement_now(const Mirror& mirror, const std::optional<Placement>& base_color);

}  // namespace selvedge
