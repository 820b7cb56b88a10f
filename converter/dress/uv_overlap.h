// Where parts of a garment share texture coordinates.
#pragma once

#include <set>

#include "format/scene/scene.h"

namespace selvedge {

/// The share of the area (in the scene, of the chosen primitives together) whose texture coordinates other
/// triangles have as well, mirrored or not: of two sleeves on one chart, all. Found on a grid of at most
/// overlap_side cells a side over all their coordinates, as they stand (2.5 is not 0.5); triangles smaller
/// than a cell have no say where they cover no middle of one. Instances of one primitive share nothing.
/// Nothing found, 0, beyond 2^28 rows of triangles. `chosen` holds indices into scene.primitives.
double overlap_of(const Scene& scene, const std::set<int>& chosen, int tex_coord);

inline constexpr int overlap_side = 1024;

}  // namespace selvedge
