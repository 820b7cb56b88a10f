// The extension SELVEDGE_materials_fabric, see spec/SELVEDGE_materials_fabric.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "format/gltf/document.h"
#include "format/scene/scene.h"

namespace selvedge {

/// Entries of the root array of fabrics; 0 without the extension.
int fabric_count(const GltfDocument& document);

/// An entry of the root array: the path of an external fabric, whether or not the file exists, or the bytes
/// of an embedded one. GLTF_EXTENSION for a malformed entry.
Result<SceneFabric> read_fabric_entry(const GltfDocument& document, int index);

/// All of them in their order.
Result<std::vector<SceneFabric>> read_fabric_entries(const GltfDocument& document);

/// The material's reference; nothing if it has none. GLTF_EXTENSION for an index beyond `fabrics` and for a
/// transform with a fault.
Result<std::optional<FabricReference>> read_fabric_reference(const GltfDocument& document, int material,
                                                             int fabrics);

/// How a texture is mapped to the surface.
struct TextureMapping {
  int tex_coord = 0;
  UvTransform transform;
};
/// The placement of a textureInfo-shaped object: KHR_texture_transform, which may name another UV set; the
/// identity without it.
TextureMapping read_texture_mapping(const Json& texture_info);

/// Largest component of a tintFactor; cloth brighter than white is no cloth.
inline constexpr double max_tint = 16;

/// A tint above 1 brightens the gloss of the fibres with the rest: where cloth of mean `albedo` owes more
/// than 5 (CIEDE2000) of its colour to that, it glows: a VARIANT_UNREACHED of a place, or nothing.
std::optional<Error> unreached_variant(const std::string& file, const std::string& place, const V3f& albedo,
                                       const V3f& tint);

/// A member of the material's extension; null without it.
const Json& fabric_extension_member(const GltfDocument& document, int material, const char* name);

/// The member of a transform that makes it unusable for a fabric, and the reason.
struct TransformFault {
  const char* member;
  std::string reason;
};

/// The fault of a transform with numbers beyond 32-bit floats.
std::optional<TransformFault> transform_range_fault(const UvTransform& transform);
/// The same for a fabric: also the fault of a scale that is 0 as a float.
std::optional<TransformFault> fabric_transform_fault(const UvTransform& transform);

/// A textureInfo-shaped object: index, texCoord if not 0, and the transform if it is not the identity.
Json texture_info(int index, int tex_coord, const UvTransform& transform);

/// A fabric that is to be added to a document.
struct FabricSource {
  std::string name;
  std::string uri;  ///< external: relative to the output; empty if embedded
  Bytes bytes;      ///< embedded
};

/// Adds the fabric to the root array and returns its index; an entry with the same URI or the same bytes is
/// used again.
Result<int> add_fabric(GltfDocument& document, const FabricSource& source);

/// Sets (or replaces) the material's reference. Precondition: both exist.
void set_fabric_reference(GltfDocument& document, int material, const FabricReference& reference);

}  // namespace selvedge
