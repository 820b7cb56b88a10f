// Lays repeats of yarn onto a dressed surface: whole ones as copies of one mesh, the others bent.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "converter/export/repeat_mesh.h"
#include "converter/export/surface.h"

namespace selvedge {

/// How the mesh of a repeat is shaped for its copies, so that few of them are too far from the cloth.
struct MeshShape {
  int stitch = 0;            ///< the tubes that are shaped: RepeatMesh::tubes_of()
  bool is_mirrored = false;  ///< x is turned over, last
  /// Steps by which the normal turns over a repeat: to x along x, to y along y, and to y along x.
  std::array<int, 3> bend{0, 0, 0};
  auto operator<=>(const MeshShape&) const = default;
};

/// The frame of a repeat, as shapes need it.
struct RepeatFrame {
  V2d period{1, 1};   ///< mm
  double height = 0;  ///< mm, of the surface
};
TubeMesh shaped_mesh(TubeMesh mesh, const MeshShape& shape, const RepeatFrame& frame);

/// A copy of such a mesh, from its frame (mm).
struct RepeatCopy {
  V3f translation{0, 0, 0};  ///< m
  V4f rotation{0, 0, 0, 1};  ///< unit quaternion x, y, z, w
  V3f scale{1, 1, 1};        ///< m a mm; > 0
  float shade = 1;           ///< factor of the light, by the variation beyond the repeat
};

/// Yarn that is drawn with one mesh of the repeat.
struct PlacedRepeats {
  std::map<MeshShape, std::vector<RepeatCopy>> copies;
  std::vector<TubeMesh> bent_meshes;  ///< of each of tubes_of(): m, world
  int bent_repeat_count = 0;          ///< whole ones, whose copies would leave too large gaps
  int cut_repeat_count = 0;           ///< by borders and seams
};

/// Axes of the plies of one curve, or of the curve itself if it has none.
using PlyLines = std::vector<std::vector<V3f>>;

struct LaidCloth {
  std::vector<PlacedRepeats> repeats;  ///< of each mesh
  std::vector<PlyLines> region_lines;  ///< of each curve in the region: m, world; none of a map
  double max_gap_radii = 0;            ///< between neighbours of which one is a copy, radii of yarn, at most
  double max_overlap_radii = 0;        ///< likewise, more than in the repeat itself
  double max_turn = 0, max_shear = 0;  ///< radians, of the surface over a repeat, at most
};

/// Places the yarn of the cells, repeats or stitches; `mesh_of_cell`: 0 outside of the region (texture
/// coordinates in repeats), 1 in it. Bent yarn follows the surface vertex by vertex; triangles whose middle
/// lies beyond it are left out. In the region all yarn is bent, and the variation displaces its rows, fading
/// in over a repeat from the region's border; outside, displacement would separate copies.
LaidCloth place_repeats(const Cloth& cloth, const std::vector<ClothCell>& cells, const Yarns& yarns,
                        const RepeatFrame& frame, std::span<const RepeatMesh> meshes,
                        const std::vector<int>& mesh_of_cell, const std::optional<Imath::Box2d>& region = {});

}  // namespace selvedge
