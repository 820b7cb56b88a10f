// Where parts of a garment share texture coordinates.
#pragma once

#include <cstdint>
#include <optional>
#include <set>

#include "format/scene/scene.h"

namespace selvedge {

/// The work that a run may spend on all its materials: rows of cells that triangles cross, and for each grid
/// as much as 2^16 of them.
struct OverlapBudget {
  std::uint64_t rows = std::uint64_t{1} << 26;
};

/// The share of the area (in the scene, of the chosen primitives together) whose texture coordinates other
/// triangles have as well, mirrored or not: of two sleeves on one chart, all. Found on a grid of at most
/// overlap_side cells a side over all their coordinates, as they stand (2.5 is not 0.5); triangles smaller
/// than a cell have no say where they cover no middle of one. Instances of one primitive, and a mesh in two
/// skins, share nothing. `chosen` holds indices into scene.primitives. Nothing beyond the budget.
std::optional<double> overlap_of(const Scene& scene, const std::set<int>& chosen, int tex_coord,
                                 OverlapBudget& budget);

inline constexpr int overlap_side = 1024;

}  // namespace selvedge
