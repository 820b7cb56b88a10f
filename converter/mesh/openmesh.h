// The one place that knows OpenMesh: bytes of a mesh file -> what stands in it, nothing made of it yet.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"

namespace selvedge {

/// A mesh as its file has it, in the file's own units and axes.
struct RawMesh {
  std::vector<V3d> positions;     ///< with all digits that the file has
  std::vector<V3f> normals;       ///< empty, or one per vertex
  std::vector<V3f> colours;       ///< empty, or one per vertex; (-1, -1, -1) where the file gives none
  bool colours_8bit = false;      ///< sRGB-coded bytes / 255, else linear
  std::vector<V3f> face_colours;  ///< empty, or one per face, as those of vertices
  bool face_colours_8bit = false;
  std::vector<std::vector<int>> faces;  ///< indices as written, perhaps out of range
};

/// Diffuse colours of an OBJ file's materials, by name.
using MaterialColours = std::map<std::string, V3f>;

/// `format` is "obj", "off" or "stl" (PLY: mesh_ply.h). A halfedge mesh is not built, so no face is dropped
/// for what its neighbours are. Refuses what cannot be decoded to its end (file_damaged) and numbers that are
/// not finite where the decoder would pass over them (mesh_not_finite). Normals are kept only where all
/// vertices have one and no vertex has two. Faces have the colours of an OFF file and those of a binary STL
/// (VisCAM's and Magics' bits); `materials` gives those of an OBJ file. Not reentrant in OpenMesh: calls wait
/// for each other.
Result<RawMesh> import_mesh(const std::string& bytes, const std::string& format, const std::string& file,
                            const MaterialColours& materials = {});

}  // namespace selvedge
