// Frames along a yarn's curve: what angles about it count from.
#pragma once

#include <vector>

#include "converter/stitch/pattern.h"

namespace selvedge {

/// A place along a yarn with a unit vector across it.
struct YarnStation {
  V3d position;
  V3d tangent;
  V3d across;
  double length = 0;  ///< from the start, mm
  V2d squeeze{0, 0};  ///< of its section (format/fabric/yarn_section.h)
};

/// Frames that are carried along without rotation about the curve.
struct YarnFrames {
  std::vector<YarnStation> stations;  ///< the last one is where the next repeat begins
  double turned = 0;                  ///< radians about the curve from the first frame to the last
};

/// Frames at most `step` mm apart. Precondition: a valid yarn.
YarnFrames frames_of(const Yarn& yarn, double step);

}  // namespace selvedge
