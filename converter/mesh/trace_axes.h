// Axes of tubes from the centres of the balls inside them.
#pragma once

#include "converter/mesh/surface_points.h"

namespace selvedge {

/// The axis of a tube: a closed polyline; from the last node it runs on to the first of the repeat that lies
/// `turns` away.
struct TubeAxis {
  V2i turns{0, 0};  ///< in periods
  double radius = 0;
  std::vector<V3d> nodes;  ///< mm, about a quarter of a radius apart

  /// The node `i` places after the first, also beyond both ends.
  V3d node(int i, const V2d& period) const;
};

/// The largest ball that touches the surface in a point from inside.
struct InnerBall {
  V3d centre{0, 0, 0};  ///< mm, x and y within the cell
  double radius = 0;
};

/// Closed axes, the clearest first. `points_per_area`: balls per mm^2 of surface; `area`: of the surface,
/// mm^2.
std::vector<TubeAxis> trace_axes(const std::vector<InnerBall>& balls, const V2d& period,
                                 double points_per_area, double area);

}  // namespace selvedge
