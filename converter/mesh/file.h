// Reads and writes meshes as OBJ and PLY files.
#pragma once

#include <optional>
#include <string>

#include "converter/mesh/cell_mesh.h"
#include "converter/mesh/guesses.h"

namespace selvedge {

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
/// are not given are guessed (guesses.h). Refuses: no such file, unknown format, cut-short or damaged files,
/// no triangles, vertices that are not finite, faces that refer to absent vertices, a bad period, and meshes
/// without extent if the period is to be guessed.
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
