// The result of an evaluation.
#pragma once

#include "format/base/vec.h"

namespace selvedge {

/// Radiance and opacity of a texel or a point towards the viewer. Not premultiplied: a picture shows
/// alpha * radiance.
struct Shading {
  V3f radiance{0, 0, 0};  ///< 1/sr; radiance under unit perpendicular irradiance
  float alpha = 0;        ///< opacity in [0, 1]
};

}  // namespace selvedge
