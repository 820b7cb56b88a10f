// Garments as OBJ files with their materials (MTL), read as glTF documents.
#pragma once

#include <string_view>

#include "format/gltf/document.h"

namespace selvedge {

/// One mesh with a primitive for each material. Polygons become fans, lengths count as metres (OBJ has no
/// unit), v is turned to glTF's. Vertices without a normal get the mean of their faces' by area. Triangles
/// without texture coordinates are primitives of their own. Of materials are read: Kd, Ke, and the
/// pictures map_Kd, map_Ke and norm (or map_Bump, where its name says that it holds normals). With a map_d
/// the alpha of map_Kd is a mask; the opacities d and Tr are not read. Of names with a drive or a root the
/// last part counts, and pictures that are not there are left out. Refuses damaged lines (FILE_DAMAGED),
/// positions that are not finite (MESH_NOT_FINITE), a text without faces (GLTF_MALFORMED), more memory than
/// the limits allow, and material files and pictures outside of the document's folder as load_gltf() does.
Result<GltfDocument> load_obj(std::string_view text, const std::string& path, const GltfLimits& limits);

}  // namespace selvedge
