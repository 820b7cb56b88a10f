// Reads and writes meshes as OBJ and PLY files.
#pragma once

#include <optional>
#include <string>

#include "converter/mesh/cell_mesh.h"
#include "format/mesh/mesh_file.h"

namespace selvedge {

enum class UpAxis { x, y, z };

const char* name_of(UpAxis axis);

/// From the file's axes to the cell's: y: (x, y, z) -> (x, -z, y); x: (x, y, z) -> (y, z, x).
template <class Vector>
Vector to_cell_axes(const Vector& v, UpAxis up) {
  if (up == UpAxis::y) return {v.x, -v.z, v.y};
  return up == UpAxis::x ? Vector(v.y, v.z, v.x) : v;
}

/// How a mesh was read, and why: each *_from is "given" or the reason of a guess, for people.
struct MeshChoices {
  V2d period{1, 1};  ///< mm
  std::string period_source;
  double scale_to_mm = 1;
  std::string scale_source;
  UpAxis up_axis = UpAxis::z;  ///< the file's axis out of the cloth
  std::string up_axis_source;
};

/// A line for each guess.
std::vector<std::string> remarks_on(const MeshChoices& choices);

/// Guesses `period`, `scale_to_mm` and `up_axis` where they are not given. The up axis is the one of least
/// extent (z unless another has less than 9/10 of its extent); a unit is a metre if the mesh is smaller than
/// 0.1 units in the plane, else a millimetre; the period comes from the comment of write_mesh(), else it is
/// the extent of the mesh, which may be 0.
MeshChoices guess_mesh_choices(const MeshFile& file, const std::string& bytes,
                               const std::optional<V2d>& period, const std::optional<double>& scale_to_mm,
                               const std::optional<UpAxis>& up_axis);

struct MeshImportOptions {
  std::optional<V2d> period{};          ///< mm
  std::optional<double> scale_to_mm{};  ///< mm per unit of the file
  V3f albedo{0.5F, 0.5F, 0.5F};         ///< of vertices without a colour, linear
  std::optional<UpAxis> up_axis{};      ///< the file's axis out of the cloth
};

/// Reads the whole mesh without repair: polygons become triangle fans, and edges may have any number of
/// faces. Only triangles that use a vertex twice are left out. Colours become albedo, face colours before
/// vertex colours (a vertex is split where its faces differ): integers are decoded by the sRGB curve, floats
/// are linear, both clamped to [0, 1]; alpha is ignored. Normals are the file's if it has exactly one for
/// each vertex, else area-weighted means of face normals. Positions are kept, except that a mesh further than
/// 64 times its size from the origin is moved towards it by whole periods, in double precision. Options that
/// are not given are guessed (guess_mesh_choices()). Refuses: no such file, unknown format, cut-short or
/// damaged files, no triangles, vertices that are not finite, faces that refer to absent vertices, a bad
/// period, and meshes without extent if the period is to be guessed.
Result<CellMesh> read_mesh(const std::string& path, const MeshImportOptions& options,
                           MeshChoices* choices = nullptr);
/// The material files that an OBJ file names and that lie beside it; none for other files.
std::vector<std::string> material_files_of(const std::string& path);
/// Reads from memory. `name` is used in messages, its ending gives the format. No other file is opened.
Result<CellMesh> read_mesh(const std::string& bytes, const std::string& name,
                           const MeshImportOptions& options);

/// Writes OBJ (with linear colours behind the positions) or binary PLY, by the path's ending: gloss, fibres,
/// hairs and the yarns themselves are lost. The file appears whole or not at all. A comment keeps the period.
Result<void> write_mesh(const std::string& path, const CellMesh& mesh);

}  // namespace selvedge
