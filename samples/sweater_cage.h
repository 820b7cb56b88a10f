// The control cage of the sweater, and the body that it hangs on.
#pragma once

#include "samples/subdivide.h"

namespace selvedge::samples {

/// The labels of the cage's quads. The names of the sides are the viewer's: right is +x. A sleeve has two
/// halves only so that the line under the arm can be told from the one above it.
enum SweaterPanel {
  panel_front,
  panel_back,
  panel_sleeve_right_front,
  panel_sleeve_right_back,
  panel_sleeve_left_front,
  panel_sleeve_left_back,
  panel_hem,
  panel_collar,
  panel_cuff_right,
  panel_cuff_left,
};

/// Where a sleeve's line runs: from the shoulder's joint towards the cuff, 35 degrees from the body, with a
/// bend to the front below the elbow. `along` is in metres from the joint; `side` +1 (right) or -1 (left).
V3d sleeve_centre(double along, int side);
V3d sleeve_direction(int side);
/// Across the sleeve, away from the line under the arm.
V3d sleeve_up(int side);

/// Some 300 quads; metres, y up, facing +z, the hem at y = -0.035. Hem, collar and cuffs are one quad high.
QuadSurface sweater_cage();

/// Signed distance, about, in metres, from a person without head and hands who wears the sweater; positive
/// outside.
double body_distance(const V3d& p);

}  // namespace selvedge::samples
