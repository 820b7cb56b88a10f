// The materials of a garment that get a fabric.
#pragma once

#include <string>
#include <vector>

#include "format/gltf/document.h"

namespace selvedge {

struct MaterialChoice {
  std::vector<std::string> materials = {};  ///< names (every material of that name) or "#index"
  bool all = false;                         ///< every material that may be cloth
  std::vector<std::string> except = {};     ///< as `materials`: not these
};

struct ChosenMaterials {
  std::vector<int> materials;           ///< at least one
  std::vector<std::string> left_alone;  ///< a line for each that `all` leaves alone by its name
};

/// `all` gives triangles without a material a new one, "fabric", and leaves alone what names itself, or all
/// of whose meshes name themselves, a button, a zip, a sole, skin, hair, an eye and the like.
/// MATERIAL_MISSING.
Result<ChosenMaterials> choose_materials(GltfDocument& document, const MaterialChoice& choice);

}  // namespace selvedge
