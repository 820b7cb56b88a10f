// A stitch's yarns as a fabric file holds them: chains of round segments.
#pragma once

#include "converter/stitch/pattern.h"
#include "format/fabric/yarns.h"

namespace selvedge {

struct YarnCurveOptions {
  /// How far a chain may lie from the curve, in radii. 0.005 bends no silhouette by what is seen at 400
  /// pixels a yarn.
  double max_sag = 0.005;
  double max_length = 1;  ///< of a segment, in radii
  double station = 2;     ///< distance between the stations of indirect light, in radii
};

/// Curves, nodes and counts of stations; no light yet. Heights are the pattern's own. Nodes are whole
/// multiples of a power of two below a 2048th of the radius, so that they take few bytes. Precondition: a
/// valid pattern, its plies laid (lay_plies()).
YarnData yarn_curves_of(const StitchPattern& pattern, const YarnCurveOptions& options = {});

}  // namespace selvedge
