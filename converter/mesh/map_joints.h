// Yarn whose stitches a map shows beside others (format/fabric/yarn_map.h): where the map joins two that are
// apart in the yarn's own repeat, the one ends as the other begins.
#pragma once

#include <span>

#include "converter/mesh/cell_mesh.h"

namespace selvedge {

/// Sets the map of a cell whose yarns run along x, lowest first, of each row as many as `yarns_of_rows` says,
/// or of a weave along y for all columns and then along x for all rows (`yarns_of_rows` is empty). `begins`:
/// fractions of the length of each yarn of a knit at which its stitches begin, whose feet are moved into rows
/// and columns. Yarns get nodes on the borders of stitches, and what the map joins, or the cell itself, the
/// mean place, direction and squeeze; stitches follow from both of their ends. The period changes by less
/// than a thousandth, so that borders have exact coordinates. Refuses (MESH_INVALID) yarns that are not so.
Result<void> set_map(YarnCell& cell, const YarnMap& map, std::span<const int> yarns_of_rows,
                     std::span<const std::vector<double>> begins);

/// Gives light at joints their mean, in directions that count from upwards.
void join_light(YarnData& yarns, const V2f& period);

/// Largest differences at a joint.
struct JointGaps {
  double place_radii = 0;
  double degrees = 0;  ///< between tangents
  double squeeze = 0;
  double light = 0;  ///< from the joint's mean over its mean square root
};
/// Precondition: a map by set_map(). Without light, that is left out.
JointGaps joint_gaps(const YarnData& yarns, const V2f& period);

}  // namespace selvedge
