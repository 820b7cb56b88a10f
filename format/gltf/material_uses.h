// The primitives of a glTF document by their material.
#pragma once

#include <map>
#include <set>
#include <utility>

#include "format/gltf/document.h"

namespace selvedge {

using PrimitiveIndex = std::pair<int, int>;                    ///< mesh, primitive
using MaterialUses = std::map<int, std::set<PrimitiveIndex>>;  ///< by material; -1: triangles without one

/// Primitives of triangles by their material, worn directly or in a mapping of KHR_materials_variants.
MaterialUses find_material_uses(const Json& json);

/// GARMENT_NO_UVS, with the JSON pointer, if one of the primitives lacks TEXCOORD_<tex_coord>.
Result<void> check_uvs(const GltfDocument& document, const std::set<PrimitiveIndex>& places, int tex_coord);

}  // namespace selvedge
