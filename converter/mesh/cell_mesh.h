// The triangle mesh of one cell: the output of stitches and mesh files, the input of the bake.
//
// Frame of the cell: millimetres, x and y along the two repeats, z out of the cloth; the cell covers [0,
// period.x) x [0, period.y) and repeats with the period. Triangles of imported meshes may cross the walls of
// the cell; those of stitches are cut exactly at the walls.
#pragma once

#include <cstdint>
#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"
#include "format/fabric/yarns.h"

namespace selvedge {

struct CellMesh {
  V2d period{1, 1};            ///< mm
  std::vector<V3f> positions;  ///< mm
  std::vector<V3f> normals;    ///< unit, per vertex, out of the yarn
  std::vector<V3f> albedo;     ///< per vertex, linear, in [0, 1]
  std::vector<V3f> fibres;     ///< unit, per vertex, along the fibres (either sign); empty: no yarn is glossy
  std::vector<Gloss> gloss;    ///< per vertex; as many as fibres
  std::vector<V3i> triangles;  ///< vertex indices, counter-clockwise seen from outside
  YarnData yarns;              ///< that the surface is of, without its light; empty: not known (find_yarns())
};

struct Box {
  V3f min{0, 0, 0};
  V3f max{0, 0, 0};
};

/// Bounds of all triangles; unused vertices are ignored. Precondition: validate() holds.
Box bounds_of(const CellMesh& mesh);

/// Refuses, with the vertex or triangle as the place: meshes without a triangle of positive area, wrong array
/// sizes, indices out of range, NaN or infinite positions, periods that are not positive. `name` is the file
/// or stitch for the message.
Result<void> validate(const CellMesh& mesh, const std::string& name);

}  // namespace selvedge
