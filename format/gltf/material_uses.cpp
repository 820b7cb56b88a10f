#include "format/gltf/material_uses.h"

#include <fmt/format.h>

#include "format/gltf/access.h"
#include "format/gltf/names.h"

namespace selvedge {

MaterialUses find_material_uses(const Json& json) {
  MaterialUses uses;
  const Json& meshes = array_member(json, "meshes");
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const Json& primitives = array_member(meshes[m], "primitives");
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const Json& primitive = primitives[p];
      const Json& mode = member(primitive, "mode");
      if (!mode.is_null() && index_of(mode) < 4) continue;  // points and lines
      const PrimitiveIndex place(static_cast<int>(m), static_cast<int>(p));
      uses[index_of(member(primitive, "material"))].insert(place);
      const Json& variants = member(member(primitive, "extensions"), names::gltf::variants);
      for (const Json& mapping : array_member(variants, "mappings"))
        uses[index_of(member(mapping, "material"))].insert(place);
    }
  }
  return uses;
}

Result<void> check_uvs(const GltfDocument& document, const std::set<PrimitiveIndex>& places, int tex_coord) {
  for (const auto& [mesh, primitive] : places) {
    const Json& json = document.json["meshes"][mesh]["primitives"][primitive];
    const std::string semantic = fmt::format("TEXCOORD_{}", tex_coord);
    if (member(member(json, "attributes"), semantic.c_str()).is_null())
      return fail(Code::garment_no_uvs, document.file,
                  fmt::format("/meshes/{}/primitives/{}/attributes", mesh, primitive), "no " + semantic);
  }
  return {};
}

}  // namespace selvedge
