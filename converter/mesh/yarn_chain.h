// From a yarn's curve to the chain of segments that a fabric file holds.
#pragma once

#include <vector>

#include "format/base/vec.h"
#include "format/fabric/yarns.h"

namespace selvedge {

struct YarnChainOptions {
  /// How far a chain may lie from the curve, in radii. 0.005 bends no silhouette by what is seen at 400
  /// pixels a yarn.
  double max_sag = 0.005;
  /// The same of flat yarn, whose section turns by a step from segment to segment: larger ones show as
  /// ridges.
  double max_flat_sag = 0.001;
  double max_length_radii = 1;       ///< of a segment, in radii
  double station_spacing_radii = 2;  ///< distance between the stations of indirect light, in radii
};

/// A place of a yarn's axis, mm, and the squeeze of its section there.
struct ChainPoint {
  V3d position;
  V3d squeeze{0, 0, 0};
};

/// Adds a curve and its nodes to `data`, and where it has `squeezes`, these of its nodes. `points` lie on the
/// yarn's axis, mm, close enough that the nodes may be any of them; the last is where the curve begins again.
/// Counts of nodes and stations are set here, all else comes from `curve`; `radius` is its radius before
/// rounding. Nodes are whole multiples of a power of two below a 2048th of the radius, so that they take few
/// bytes. Precondition: three points or more.
void append_chain(YarnCurve curve, const std::vector<ChainPoint>& points, double radius,
                  const YarnChainOptions& options, YarnData& data);

/// Distance from `point` to the straight line from `a` to `b` (both ends included).
double chord_distance(const V3d& point, const V3d& a, const V3d& b);

}  // namespace selvedge
