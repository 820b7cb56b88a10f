// Reads meshes from OBJ, OFF, PLY and STL files and writes OBJ and PLY.
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

/// The whole mesh, nothing repaired and nothing dropped: faces with more than three sides are cut into fans,
/// faces that share an edge with any number of others stay. Only triangles that use a vertex twice are left
/// out, they have no area. Vertex colours are taken as albedo, and colours of faces before those of vertices
/// (a vertex is split where its faces differ): those of bytes (or other whole numbers) through the sRGB
/// curve, floats as linear, clamped to [0, 1]; alpha is ignored. Normals are the file's where it has one and
/// only one for each vertex, else the area-weighted mean of the faces' around. Vertices stay where they are
/// (but for meshes that lie more than 64 times their size away, which come near by whole periods in double
/// precision): the period alone says how copies follow each other. Choices that are not given are guessed
/// (guesses.h). Refuses: no such file, unknown format, cut-short or damaged files, no triangles,
/// vertices that are not finite, faces that refer to absent vertices, a bad period, and a mesh without extent
/// to guess one from.
Result<CellMesh> read_mesh(const std::string& path, const MeshImportOptions& options,
                           MeshChoices* choices = nullptr);
/// From memory: `name` is used in messages, and its ending says the format. No other file is opened.
Result<CellMesh> read_mesh(const std::string& bytes, const std::string& name,
                           const MeshImportOptions& options);

/// Writes OBJ (with linear colours behind the positions) or binary PLY (colours as 8-bit sRGB), by the path's
/// ending. The file appears whole or not at all. The period is kept in a comment of both.
Result<void> write_mesh(const std::string& path, const CellMesh& mesh);

}  // namespace selvedge
