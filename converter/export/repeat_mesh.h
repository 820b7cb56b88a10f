// The yarn of one repeat as tubes of triangles; of yarn with a map, of each of its stitches.
//
// A cell is a repeat, or a stitch of the map; its tubes, joints and bounds are in its own frame.
#pragma once

#include <Imath/ImathBox.h>

#include <cstdint>
#include <span>
#include <vector>

#include "format/fabric/yarns.h"
#include "format/picture/image.h"

namespace selvedge {

/// Frame of the fabric, mm; the ends of a tube lie open where the tubes of neighbouring repeats begin.
/// Normals lean to where a vertex gets most of its light from.
struct TubeMesh {
  std::vector<V3f> positions;
  std::vector<V3f> normals;            ///< unit
  std::vector<V2f> tex_coords;         ///< of the picture
  std::vector<float> shades;           ///< factors of the picture; empty: 1
  std::vector<std::uint32_t> indices;  ///< three per triangle, counter-clockwise seen from outside
};

/// Tubes of the curves that reflect alike, of a cell.
struct MergedTubes {
  int first_curve = 0;  ///< the first of them
  TubeMesh mesh;
};

/// Under a light l above the cloth, a point of the surface with the normal n reflects
/// picture max(0, n . l) / pi: direct light with what other yarn hides of it, and light by way of other yarn.
struct RepeatMesh {
  std::vector<MergedTubes> tubes;  ///< as many of each stitch, which a YarnMap numbers
  int stitches = 1;                ///< of the yarn's map
  /// Tubes of a stitch, one for each way to reflect.
  std::span<const MergedTubes> tubes_of(int stitch) const {
    const std::size_t count = tubes.size() / stitches;
    return std::span(tubes).subspan(stitch * count, count);
  }
  Image picture;  ///< linear, three channels, >= 0: the yarns' surfaces, columns around them, rows along them
};

/// The size of a cell, mm.
V2f cell_size(const Yarns& yarns);

/// A cell has at most these triangles, in the mean over those that a map shows, unless min_triangles() are
/// more; the picture has about these pixels. Plies are tubes of their own where the triangles suffice; else
/// the yarn is one tube, with its plies in the picture.
RepeatMesh mesh_of_repeat(const Yarns& yarns, double triangles, double pixels);
/// Triangles of a cell, in the mean over those that have some.
std::int64_t mesh_triangle_count(const RepeatMesh& mesh);

/// The fewest triangles that a cell can have, and those beyond which more show no detail; means likewise.
double min_triangles(const Yarns& yarns);
double max_triangles(const Yarns& yarns);

/// Where yarn continues in a neighbouring repeat, or touches its yarn; axes, in the frame of either's cell.
/// Stitches of a map have joints amid their sides, whatever they are.
struct YarnJoint {
  V3f own_point{0, 0, 0}, other_point{0, 0, 0};  ///< mm
  V2i neighbour_offset{0, 0};    ///< periods along x and y from the own cell to the neighbour's
  float radius = 0;              ///< mm, of a round yarn with the same area
  bool is_continuation = false;  ///< one yarn; else two that touch
};
std::vector<YarnJoint> joints_of(const Yarns& yarns);

/// Where the yarn of a cell lies, in cells: around the cell from (0, 0) to (1, 1), v grows downwards.
Imath::Box2d yarn_uv_bounds(const Yarns& yarns);

}  // namespace selvedge
