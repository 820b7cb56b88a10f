// The primitives of a glTF document by their material.
#pragma once

#include <map>
#include <set>
#include <utility>

#include "format/gltf/document.h"

namespace selvedge {

using Place = std::pair<int, int>;            ///< mesh, primitive
using Uses = std::map<int, std::set<Place>>;  ///< by material; -1: triangles without one

/// Primitives of triangles by their material, worn directly or in a mapping of KHR_materials_variants.
Uses uses_of(const Json& json);

/// GARMENT_NO_UVS, with the JSON pointer, if one of the primitives lacks TEXCOORD_<tex_coord>.
Result<void> check_uvs(const GltfDocument& document, const std::set<Place>& places, int tex_coord);

}  // namespace selvedge
