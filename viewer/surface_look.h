// How a surface is drawn, as the passes have to know it.
#pragma once

#include "format/vec.h"

namespace selvedge {

/// What the passes have to know of a material.
struct SurfaceLook {
  int fabric = -1;  ///< index into the fabrics; -1: `base_color`
  V4f base_color{1, 1, 1, 1};
  int image = -1;              ///< index into the images, a factor on `base_color`; -1: none
  float opaque_from = 0;       ///< where the opacity of the base colour is less, nothing is drawn
  bool keeps_opacity = false;  ///< else base colour or fabric count as opaque
  bool culls_back = false;
};

/// The largest width and height of a frame.
inline constexpr int index_pass_side_limit = 16384;

}  // namespace selvedge
