#include "format/scene/scene.h"

#include <cmath>

namespace selvedge {

// The listing in the extension's text turns the other way round than its wording, its test model
// (TextureTransformTest) and all viewers: counter-clockwise in the picture, where v grows downwards
// (KhronosGroup/glTF issue 1563). Scale comes first, then the rotation, then the offset.
V2d UvTransform::apply_linear(const V2d& uv) const {
  const V2d scaled(uv.x * scale.x, uv.y * scale.y);
  if (rotation == 0) return scaled;
  const double c = std::cos(rotation);
  const double s = std::sin(rotation);
  return {c * scaled.x + s * scaled.y, -s * scaled.x + c * scaled.y};
}

V2d UvTransform::apply(const V2d& uv) const { return apply_linear(uv) + offset; }

}  // namespace selvedge
