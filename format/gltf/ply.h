// Garments as PLY files with texture coordinates, read as glTF documents.
#pragma once

#include <string_view>

#include "format/gltf/document.h"

namespace selvedge {

/// Whether the bytes are those of a PLY file.
bool is_ply(std::string_view bytes);

/// One mesh of one material, "cloth", with the picture of a `comment TextureFile` as its base colour.
/// Polygons become fans, lengths count as metres (PLY has no unit), v is turned to glTF's. Texture
/// coordinates are s, t or u, v or texture_u, texture_v of vertices, or `texcoord` lists of faces, two
/// numbers a corner, which win; faces without are a primitive of their own. Vertices without nx, ny, nz get
/// the mean of their faces' by area. Refuses damaged files (FILE_DAMAGED), positions that are not finite
/// (MESH_NOT_FINITE), files without faces (GLTF_MALFORMED), more memory than the limits allow
/// (FILE_TOO_LARGE), and pictures outside of the document's folder (GLTF_REFERENCE). Pictures that are not
/// there are left out.
Result<GltfDocument> load_ply(std::string_view bytes, const std::string& path, const GltfLimits& limits);

}  // namespace selvedge
