// The triangle mesh of one cell: the output of stitches and mesh files, the input of the bake.
//
// Frame of the cell: millimetres, x and y along the two repeats, z out of the cloth; the cell covers [0,
// period.x) x [0, period.y) and repeats with the period. Triangles of imported meshes may cross the walls of
// the cell; triangles of stitches are cut exactly at the walls.
#pragma once

#include <Imath/ImathBox.h>

#include <vector>

#include "format/base/error.h"
#include "format/base/vec.h"
#include "format/fabric/yarns.h"

namespace selvedge {

/// Where a vertex lies on CellMesh::yarns, as Yarns::point_at() finds it. A curve of -1: on none.
struct YarnPlace {
  int curve = -1;
  int ply = 0;               ///< of a curve with strands
  float chain_fraction = 0;  ///< fraction of the chain, from 0 to about 1
  float angle_turns = 0;     ///< turns about the yarn or ply, in [-1/2, 1/2]
};

/// Hairs that stand off the yarns: round, each a line of points_per_hair points. They may leave the cell.
struct Hairs {
  static constexpr int points_per_hair = hair_point_count;
  std::vector<V3f> points;          ///< mm, hair by hair
  std::vector<int> root_triangles;  ///< of each, the triangle that it grows from: it has its albedo and gloss
  std::vector<float> radius;        ///< of each, mm
  std::vector<float> transparency;  ///< transparency of each
};

struct CellMesh {
  V2d period{1, 1};            ///< mm
  std::vector<V3f> positions;  ///< mm
  std::vector<V3f> normals;    ///< unit, per vertex, out of the yarn
  std::vector<V3f> albedo;     ///< per vertex, linear, in [0, 1]
  std::vector<V3f>
      fibre_directions;      ///< unit, per vertex, along the fibres (either sign); empty: no yarn is glossy
  std::vector<Gloss> gloss;  ///< per vertex; as many as fibres
  std::vector<float>
      transmission;  ///< per vertex, fraction of the diffuse light that goes through; empty: none
  std::vector<YarnPlace> yarn_places;  ///< per vertex; empty: no yarn has strands, hairs or irregularity
  Hairs hairs;
  std::vector<V3i> triangles;  ///< vertex indices, counter-clockwise seen from outside
  YarnData yarns;              ///< that the surface is of, without its light; empty: not known (find_yarns())
};

/// Bounds of all triangles; unused vertices are ignored. Precondition: validate() holds.
Imath::Box3f bounds_of(const CellMesh& mesh);

/// Refuses meshes without a triangle of positive area, positions that are not finite, with the vertex as the
/// place, and periods that are not positive; the rest is up to who makes a mesh. `name` is the file or stitch
/// for the message.
Result<void> validate(const CellMesh& mesh, const std::string& name);

/// The yarn of one repeating cell, without a mesh.
struct YarnCell {
  V2d period{1, 1};  ///< mm
  YarnData yarns;    ///< without light; heights above the lowest point
  std::vector<V3f>
      wall_transmission;  ///< of each curve: fraction of matt light that goes through the wall of a ply
  double thickness = 0;   ///< mm, without hairs
};

/// The same of a mesh with yarns. Precondition: validate() holds of it.
YarnCell yarn_cell_of(const CellMesh& mesh);

/// Moves the yarns so that their lowest point lies at height 0, and sets the thickness. Precondition:
/// validate() holds of them.
void move_to_ground(YarnCell& cell);

}  // namespace selvedge
