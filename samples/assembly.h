// Garments under construction: points that all patches share, and patches with texture coordinates.
#pragma once

#include <string>
#include <vector>

#include "format/base/vec.h"
#include "samples/gltf_writer.h"

namespace selvedge::samples {

/// A piece of cloth with one material and one chart of texture coordinates.
struct Patch {
  std::string material;
  std::vector<int> points;      ///< per vertex, the point it lies on; seams have two vertices on one point
  std::vector<V2d> tex_coords;  ///< per vertex, one unit per metre, v down (glTF)
  std::vector<V3i> triangles;   ///< vertices of this patch, counter-clockwise seen from outside
};

struct Assembly {
  std::vector<V3d> points;  ///< metres
  std::vector<Patch> patches;
};

/// One unit normal per point, weighted by area over the triangles of all patches.
std::vector<V3d> normals_of(const Assembly& assembly);

/// For writing: one primitive per material, in the order of the first patch of each. Vertices on one point
/// have the same position and normal, bit by bit.
Garment garment_of(const Assembly& assembly, const std::string& name);

}  // namespace selvedge::samples
