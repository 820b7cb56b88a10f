// Garments as OBJ files with their materials (MTL) and as PLY files, read as glTF documents.
#pragma once

#include <string_view>

#include "format/gltf/document.h"

namespace selvedge {

/// Whether a file is read by load_mesh_document(): by its ending .obj, or the first bytes of PLY.
bool is_mesh_file(std::string_view bytes, const std::string& path);

/// One mesh with a primitive for each material, triangles without texture coordinates apart. Polygons become
/// fans, a unit of length a metre. Vertices without a normal get the mean of their faces' by area, and
/// COLOR_0 where the file has colours, which are sRGB. Materials have Kd, Ke, map_Kd, map_Ke (-s, -o) and
/// norm (or map_Bump, where its name says that it holds
/// normals); map_d, or else the alpha of map_Kd, is a mask; d and Tr are not read. A comment "TextureFile" of
/// PLY names the picture. Of names with a drive or a root the last part counts; missing files and materials
/// are left out with a remark (GltfDocument::remarks). Refuses the faults of format/mesh, files without faces
/// (GLTF_MALFORMED), more memory than the limits allow, and material files and pictures outside of the
/// document's folder as load_gltf() does.
Result<GltfDocument> load_mesh_document(std::string_view bytes, const std::string& path,
                                        const GltfLimits& limits);

}  // namespace selvedge
