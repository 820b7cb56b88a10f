// The mirror of a fabric reference in a material's extras, for the case that a tool drops the extension
// (spec/SELVEDGE_materials_fabric, "Mirror in extras").
#pragma once

#include <optional>
#include <string>

#include "format/gltf/fabric_extension.h"
#include "format/scene/scene.h"

namespace selvedge {

struct Mirror {
  Placement fabric;
  std::optional<Placement>
      base_color;      ///< of the core material when the mirror was written; nothing: no texture
  std::string name;    ///< of the fabric's entry; may be empty
  std::string uri;     ///< relative to the glTF; empty if the fabric was embedded
  std::string digest;  ///< see digest_of_fabric; empty if unknown
  Json parts;          ///< an object: `maskCutoff`, `tintFactor` and `kept`, as far as there are such
};

/// Completes the mirror that set_fabric_reference wrote: adds the fabric's digest, what of the garment the
/// extension has, and the placement of the base colour texture if it differs from the fabric's. Precondition:
/// the core material is complete. Extras that are not an object have no mirror and stay as they are.
void complete_mirror(GltfDocument& document, int material, const std::string& digest);

/// The material's mirror, or nothing. GLTF_EXTENSION if it is malformed.
Result<std::optional<Mirror>> read_mirror(const GltfDocument& document, int material);

/// Writes what of the garment the mirror remembers to the material's extension, textures from the core
/// material. Returns the names of those that are gone.
std::vector<std::string> restore_parts(GltfDocument& document, int material, const Mirror& mirror);

/// The placement of the material's base colour texture, if it has one.
std::optional<Placement> base_color_placement(const GltfDocument& document, int material);

/// The fabric's placement now. An optimiser that requantises texture coordinates changes the transform of the
/// base colour texture to match, from mirror.base_color to `base_color`; the same change is applied to the
/// fabric's transform. Nothing if the change is unknown: no base colour texture before or now, another UV set
/// than the fabric's, a changed rotation, a scale of zero.
std::optional<Placement> placement_now(const Mirror& mirror, const std::optional<Placement>& base_color);

}  // namespace selvedge
