// The contents of OBJ and PLY files: what garments and cells of cloth are read from.
//
// The readers are our own. Mesh libraries build halfedges, which drop faces of meshes that are not
// two-manifolds, and read single precision, which loses all digits far from the origin.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"
#include "format/mesh/ply.h"

namespace selvedge {

/// A corner of a face: indices; -1: none.
struct MeshCorner {
  int position = -1;
  int uv = -1;
  int normal = -1;
  bool operator==(const MeshCorner&) const = default;
};

/// Colours as a file has them. The arrays are empty, or have one for each position or face; (-1, -1, -1):
/// none.
struct MeshColours {
  std::vector<V3f> values;
  bool is_srgb = false;  ///< sRGB integers over the largest of their type; else linear
};

/// A mesh in the units and axes of its file. No index is out of range.
struct MeshFile {
  std::vector<V3d> positions;  ///< with all digits of the file, finite in single precision
  std::vector<V3d> normals;    ///< as written, of any length
  std::vector<V2f> uvs;        ///< finite; v grows downwards, as in glTF
  MeshColours colours;
  MeshColours face_colours;            ///< of PLY
  std::vector<MeshCorner> corners;     ///< of all faces, behind each other
  std::vector<std::size_t> face_ends;  ///< of each face, in `corners`
  std::vector<int> face_materials;     ///< of OBJ, for each face: into `materials`
  std::vector<std::string> materials;  ///< names; "" without one
  std::vector<std::string> material_files;

  std::span<const MeshCorner> face(std::size_t index) const {
    const std::size_t begin = index == 0 ? 0 : face_ends[index - 1];
    return std::span(corners).subspan(begin, face_ends[index] - begin);
  }
};

/// The most bytes of memory that a byte of an OBJ or MTL text takes.
inline constexpr std::uint64_t obj_memory_factor = 24;

// `file` is for messages, whose place is the line, vertex or face. FILE_DAMAGED for lines and faces that
// cannot be read, indices out of range and texture coordinates that are not finite; MESH_NOT_FINITE for
// positions that are not finite in single precision.

/// Indices count from 1, or backwards from -1, over the lines before. Colours behind positions are linear.
Result<MeshFile> read_obj(std::string_view text, const std::string& file);

/// Reads x, y, z, nx, ny, nz, texture coordinates (u and v, s and t, texture_u and texture_v) and colours
/// (yarn_red, red, r or diffuse_red ...) of element "vertex"; colours, the list vertex_indices (or
/// vertex_index), and texcoord of element "face". All else is skipped.
Result<MeshFile> ply_to_mesh(const PlyFile& ply, const std::string& file);

/// A picture of an MTL file.
struct TextureMap {
  std::string file;
  V2d scale{1, 1};   ///< -s: of the texture coordinates, v upwards
  V2d offset{0, 0};  ///< -o
};

/// A material of an MTL file.
struct MtlMaterial {
  std::optional<V3d> diffuse;   ///< Kd, not negative; none for the black that programs write beside map_Kd
  std::optional<V3d> emission;  ///< Ke, not negative
  TextureMap diffuse_map;       ///< map_Kd
  TextureMap emission_map;      ///< map_Ke
  TextureMap normal_map;        ///< norm, or map_Bump of a name with "normal"
  std::string mask_file;        ///< map_d
};

/// Adds the materials of an MTL text, by name. Lines that cannot be read are skipped.
void read_mtl(std::string_view text, std::map<std::string, MtlMaterial>& materials);

/// False unless the whole word is a number. Numbers out of range become infinite or 0.
bool parse_number(std::string_view word, double& value);

}  // namespace selvedge
