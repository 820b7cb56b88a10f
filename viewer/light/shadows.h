// Shadow maps: the depth of the surfaces nearest to each light, and their look-up.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "format/base/vec.h"
#include "format/scene/lights.h"

namespace selvedge {

/// Side of a map in texels.
inline constexpr int min_shadow_size = 16;
inline constexpr int max_shadow_size = 8192;
inline constexpr int default_shadow_size = 2048;
/// Maximum number of lights that cast shadows; others shine through everything.
inline constexpr std::size_t max_shadows = 16;

/// The projection of a light. A point p (m, relative to the surfaces' origin) lies at (x, y, z, w) = rows *
/// (p, 1): at the texels (x / w, y / w) of the map, (0, 0) being the outer corner of the first texel of the
/// first row, at the depth z / w in [0, 1].
struct ShadowView {
  std::size_t light = 0;  ///< index into the lights
  int size = 1;
  std::array<V4f, 4> rows{};
  float texel_cell_size = 1;  ///< a texel's side where w = 1, m; it grows with w
  bool operator==(const ShadowView&) const = default;
};

/// A coordinate of rows * (p, 1).
inline float homogeneous_coordinate(const V4f& row, const V3f& p) {
  return row.x * p.x + row.y * p.y + row.z * p.z + row.w;
}

/// Views of the first `max_shadows` lights that can cast shadows: directional lights and spots with cones
/// below 160 degrees. Each covers all `positions` (relative to `origin`, at least one), a spot's those within
/// its cone.
std::vector<ShadowView> shadow_views(std::span<const Light> lights, std::span<const V3f> positions,
                                     const V3d& origin, int size);

/// The same view at half the size.
ShadowView half_size_view(const ShadowView& view);

struct ShadowMap {
  ShadowView view;
  std::vector<float> depths;  ///< of the nearest surface, row by row; 1: no surface
};

/// The fraction of the light that reaches a point of a surface; `normal` is its unit normal on the viewer's
/// side, `light` the unit direction towards the light. Percentage-closer filtering (Reeves, Salesin and Cook
/// 1987) over 3 x 3 texels, bilinear between them. 0 if the surface faces away from the light, 1 outside of
/// the map.
float shadow_visibility(const ShadowMap& map, const V3f& point, const V3f& normal, const V3f& light);

}  // namespace selvedge
