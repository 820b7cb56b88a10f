// The contents of OBJ and PLY files, before they become a cell.
//
// The readers are our own. Mesh libraries build halfedges, which drop faces of meshes that are not
// two-manifolds, and read single precision, which loses all digits far from the origin.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "converter/mesh/cell_mesh.h"
#include "format/base/error.h"
#include "format/base/vec.h"

namespace selvedge {

/// A mesh in the units and axes of its file.
struct RawMesh {
  std::vector<V3d> positions;     ///< with all digits of the file
  std::vector<V3f> normals;       ///< empty, or one per vertex
  std::vector<V3f> colours;       ///< empty, or one per vertex; (-1, -1, -1) where the file gives none
  bool colours_8bit = false;      ///< sRGB-coded bytes / 255, else linear
  std::vector<V3f> face_colours;  ///< empty, or one per face, like those of vertices
  bool face_colours_8bit = false;
  /// What PLY files of Selvedge hold beside: gloss, fibres, transmission, places and hairs as CellMesh has
  /// them, and yarns without their light.
  std::vector<V3f> fibres;
  std::vector<Gloss> gloss;
  std::vector<float> transmission;
  std::vector<YarnSkin> skins;
  std::vector<YarnPlace> places;
  std::uint64_t seed = 1;
  Hairs hairs;
  YarnCounts yarn_counts;
  std::vector<float> yarn_values;
  std::vector<std::vector<int>> faces;  ///< indices as written, perhaps out of range
};

/// Diffuse colours of an OBJ file's materials, by name.
using MaterialColours = std::map<std::string, V3f>;

// All readers refuse files that cannot be decoded to their end (file_damaged), that of OBJ also positions
// that are not finite in single precision (mesh_not_finite). `file` is for messages.

/// Colours after positions are linear. Normals are kept only if each vertex has exactly one. Faces have the
/// colours of their materials, (-1, -1, -1) if `materials` lacks them.
Result<RawMesh> read_obj(const std::string& bytes, const std::string& file, const MaterialColours& materials);
/// Names of the material files that an OBJ text refers to.
std::vector<std::string> material_files(const std::string& bytes);
/// Adds the diffuse colours (Kd) of a material file, unconverted.
void read_materials(const std::string& text, MaterialColours& colours);

/// ASCII and binary PLY of both byte orders with any numeric types: x, y, z, nx, ny, nz, red, green, blue
/// (also r, g, b and diffuse_*) of element "vertex", the colours and the list vertex_indices (or
/// vertex_index) of element "face"; everything else is skipped. Colours of integer type are divided by the
/// type's largest value and count as sRGB. What write_ply() adds has names that begin with "yarn_".
Result<RawMesh> read_ply(const std::string& bytes, const std::string& file);

/// A binary PLY file with all of a mesh: colours also as 8-bit sRGB for other programs.
std::string write_ply(const CellMesh& mesh, const std::string& comment);

}  // namespace selvedge
