// What evaluation gives.
#pragma once

#include "format/base/vec.h"

namespace selvedge {

/// What a texel or a point sends towards the viewer. Not premultiplied: the picture shows alpha * radiance.
struct Shading {
  V3f radiance{0, 0, 0};  ///< 1/sr; radiance under unit perpendicular irradiance
  float alpha = 0;        ///< opacity in [0, 1]
};

}  // namespace selvedge
