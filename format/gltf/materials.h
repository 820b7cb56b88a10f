// Reading a glTF document's materials, with their pictures, into a Scene.
#pragma once

#include <map>
#include <set>
#include <utility>

#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Fills scene.materials, images and fabrics; materials keep their order. Pictures are loaded, up to
/// `image_bytes` in total, fabrics until there are more than `memory` bytes of them; an unreadable one is
/// remarked and its texture left out. Files of fabrics are not opened. Broken rules of
/// SELVEDGE_materials_fabric are added to `issues`, as are transforms of textures beyond 32-bit floats.
void read_materials(const GltfDocument& document, std::uint64_t image_bytes, std::uint64_t memory,
                    Scene& scene, IssueSink& issues);

/// The base colour texture of a material, or the diffuse one of KHR_materials_pbrSpecularGlossiness, which
/// takes its place; null without.
const Json& base_texture_of(const Json& material);

/// The format, not read, of a picture that an extension gives a texture: "KTX2", "AVIF", "DDS" or "".
std::string unsupported_texture_format(const Json& texture);

/// Adds a remark, unless the scene has it already or has a hundred.
void add_remark(Scene& scene, std::string text);

using PrimitiveIndex = std::pair<int, int>;                    ///< mesh, primitive
using MaterialUses = std::map<int, std::set<PrimitiveIndex>>;  ///< by material; -1: triangles without one

/// Primitives of triangles by their material, worn directly or in a mapping of KHR_materials_variants.
MaterialUses find_material_uses(const Json& json);

/// GARMENT_NO_UVS, with the JSON pointer, if one of the primitives lacks TEXCOORD_<tex_coord>.
Result<void> check_uvs(const GltfDocument& document, const std::set<PrimitiveIndex>& places, int tex_coord);

}  // namespace selvedge
