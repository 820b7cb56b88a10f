#include "format/scene/scene.h"

#include <algorithm>
#include <cmath>

#include "format/scene/framing.h"

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

bool is_in_coordinate_range(const V3d& place) {
  constexpr double reach = 1e9;
  return std::abs(place.x) <= reach && std::abs(place.y) <= reach && std::abs(place.z) <= reach;
}

Result<std::vector<V3d>> world_points(const Scene& scene) {
  std::vector<V3d> points;
  for (const SceneInstance& instance : scene.instances) {
    const ScenePrimitive& primitive = scene.primitives[instance.primitive];
    const std::vector<V3d> placed = used_points(scene, instance);
    if (!std::ranges::all_of(placed, is_in_coordinate_range) ||
        !std::ranges::all_of(primitive.positions, is_in_coordinate_range,
                             [](const V3f& p) { return V3d(p); }))
      return fail(Code::mesh_not_finite, scene.file, primitive.name, "a position is beyond 10^9 m");
    points.insert(points.end(), placed.begin(), placed.end());
  }
  if (std::ranges::all_of(points, [&](const V3d& p) { return p == points.front(); }))
    return fail(Code::garment_empty, scene.file, "",
                "there is nothing to draw" + (scene.remarks.empty() ? "" : "; " + scene.remarks.back()));
  return points;
}

}  // namespace selvedge
