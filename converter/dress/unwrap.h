// Texture coordinates for garments that have none.
#pragma once

#include <set>

#include "converter/dress/uv_scale.h"
#include "format/gltf/access.h"
#include "format/gltf/materials.h"

namespace selvedge {

struct UnwrapReport {
  int chart_count = 0;
  bool had_uvs = false;  ///< there were texture coordinates before
};

/// Gives the places of a material texture coordinates in metres, in place of the set's old ones: charts
/// (charts.h) of each primitive, below each other. Vertices at seams become several; normals and tangents
/// that are not unit and joints without weight are mended, so that no fault is there twice. Tangents follow
/// the set if a normal texture is on it; without a normal texture they are dropped. Skins and morph targets
/// are kept: what is laid flat is the mesh without them, in the size that `in_scene`, of the same document,
/// has for it. A primitive without an area gets zeros where it has none. GARMENT_EMPTY without a triangle
/// that has an area, GARMENT_NO_UVS for a set above one that is missing, both of a document that is as it
/// was.
Result<UnwrapReport> unwrap(GltfDocument& document, const std::set<PrimitiveIndex>& places, int tex_coord,
                            const PrimitivesInScene& in_scene);

/// Gives every accessor of a primitive's attributes and morph targets new elements: element i is element
/// sources[i] of the old one; those that name one accessor share the new one too. The indices are left to the
/// caller. Throws Failure.
void gather_vertices(GltfDocument& document, GltfReader& reader, Json& primitive,
                     const std::vector<std::uint32_t>& sources, const std::string& place);

}  // namespace selvedge
