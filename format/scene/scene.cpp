#include "format/scene/scene.h"

#include <cmath>

namespace selvedge {

// Scale, then rotation, then offset. The rotation is counter-clockwise in the picture, where v grows
// downwards, as in the extension's wording, its test model (TextureTransformTest) and all viewers; the
// listing in its text has the other direction (KhronosGroup/glTF issue 1563).
V2d UvTransform::apply_linear(const V2d& uv) const {
  const V2d scaled(uv.x * scale.x, uv.y * scale.y);
  if (rotation == 0) return scaled;
  const double c = std::cos(rotation);
  const double s = std::sin(rotation);
  return {c * scaled.x + s * scaled.y, -s * scaled.x + c * scaled.y};
}

V2d UvTransform::apply(const V2d& uv) const { return apply_linear(uv) + offset; }

}  // namespace selvedge
