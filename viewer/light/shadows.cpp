#include "viewer/light/shadows.h"

#include <Imath/ImathInterval.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace selvedge {
namespace {

/// Texels by which a point leaves its surface before the look-up, so that the surface does not shadow itself:
/// along the normal, times the sine between normal and light; and towards the light. They suffice for planes:
/// the farthest tap is less than 2 sqrt(2) texels away.
constexpr float normal_offset = 3;
constexpr float light_offset = 0.5F;
/// Margin in texels, for taps beyond the scene.
constexpr double margin = 4;
/// Maximum half angle of a spot with a shadow map.
constexpr double widest_cone = 80 * 3.14159265358979 / 180;
/// Near plane of a spot as a fraction of its far plane.
constexpr double nearest_fraction = 1e-3;

/// Two directions perpendicular to `d`.
std::array<V3d, 2> across(const V3d& d) {
  const V3d axis = std::abs(d.y) < 0.9 ? V3d(0, 1, 0) : V3d(1, 0, 0);
  const V3d right = axis.cross(d).normalized();
  return {right, d.cross(right)};
}

using Range = Imath::Interval<double>;

V4f row_of(const V3d& direction, double offset) {
  return {static_cast<float>(direction.x), static_cast<float>(direction.y), static_cast<float>(direction.z),
          static_cast<float>(offset)};
}

ShadowView parallel_view(const V3d& towards_light, std::span<const V3f> positions, int size) {
  const auto [right, up] = across(towards_light);
  Range x;
  Range y;
  Range depth;
  for (const V3f& position : positions) {
    const V3d p(position);
    x.extendBy(p.dot(right));
    y.extendBy(p.dot(up));
    depth.extendBy(-p.dot(towards_light));
  }
  const double extent = std::max({x.size(), y.size(), 1e-9});
  const double texel = extent / (size - 2 * margin);
  const double range = std::max(depth.size(), 1e-9);
  // A margin keeps surfaces off the near and far planes.
  const double near = depth.min - 0.01 * range;
  ShadowView view;
  view.size = size;
  view.texel_cell_size = static_cast<float>(texel);
  view.rows = {row_of(right / texel, 0.5 * size - x.center() / texel),
               row_of(up / texel, 0.5 * size - y.center() / texel),
               row_of(-towards_light / (1.02 * range), -near / (1.02 * range)), V4f(0, 0, 0, 1)};
  return view;
}

std::optional<ShadowView> spot_view(const Light& light, std::span<const V3f> positions, const V3d& origin,
                                    int size) {
  const V3d axis = -light.direction;
  const V3d place = light.position - origin;
  const double half_angle = std::acos(std::clamp(light.outer_cosine, -1.0, 1.0));
  if (!(half_angle > 0 && half_angle < widest_cone)) return std::nullopt;
  Range depth;
  for (const V3f& position : positions) depth.extendBy((V3d(position) - place).dot(axis));
  if (!(depth.max > 0)) return std::nullopt;
  const double far = 1.01 * depth.max;
  const double near = std::max(0.99 * depth.min, nearest_fraction * far);
  const auto [right, up] = across(light.direction);
  const double texel = 2 * std::tan(half_angle) / (size - 2 * margin);
  ShadowView view;
  view.size = size;
  view.texel_cell_size = static_cast<float>(texel);
  // x = (right . (p - place)) / texel + size / 2 * w, and w the depth.
  const auto window = [&](const V3d& direction) {
    const V3d d = direction / texel + axis * (0.5 * size);
    return row_of(d, -d.dot(place));
  };
  // z / w is 0 at the near, 1 at the far plane.
  const double scale = far / (far - near);
  view.rows = {window(right), window(up), row_of(axis * scale, -axis.dot(place) * scale - scale * near),
               row_of(axis, -axis.dot(place))};
  return view;
}

}  // namespace

std::vector<ShadowView> shadow_views(std::span<const Light> lights, std::span<const V3f> positions,
                                     const V3d& origin, int size) {
  std::vector<ShadowView> views;
  for (std::size_t i = 0; i < lights.size() && views.size() < max_shadows; ++i) {
    std::optional<ShadowView> view;
    if (lights[i].kind == LightKind::directional)
      view = parallel_view(lights[i].direction, positions, size);
    else if (lights[i].kind == LightKind::spot)
      view = spot_view(lights[i], positions, origin, size);
    if (!view) continue;
    view->light = i;
    views.push_back(*view);
  }
  return views;
}

ShadowView half_size_view(const ShadowView& view) {
  ShadowView half = view;
  half.size = view.size / 2;
  const auto middle = 0.5F * static_cast<float>(view.size);
  const auto inner = static_cast<float>(2 * margin);
  const float scale = (static_cast<float>(half.size) - inner) / (static_cast<float>(view.size) - inner);
  for (int k = 0; k < 2; ++k)
    half.rows[k] = (view.rows[k] - view.rows[3] * middle) * scale +
                   view.rows[3] * (0.5F * static_cast<float>(half.size));
  half.texel_cell_size = view.texel_cell_size / scale;
  return half;
}

float shadow_visibility(const ShadowMap& map, const V3f& point, const V3f& normal, const V3f& light) {
  const float cosine = normal.dot(light);
  if (!(cosine > 0)) return 0;
  const ShadowView& view = map.view;
  const float texel = view.texel_cell_size * homogeneous_coordinate(view.rows[3], point);
  const float sine = std::sqrt(std::max(1 - cosine * cosine, 0.0F));
  const V3f p = point + normal * (texel * normal_offset * sine) + light * (texel * light_offset);
  const float w = homogeneous_coordinate(view.rows[3], p);
  if (!(w > 0)) return 1;
  const V3f in_map = V3f(homogeneous_coordinate(view.rows[0], p), homogeneous_coordinate(view.rows[1], p),
                         homogeneous_coordinate(view.rows[2], p)) /
                     w;
  const V2f corner(in_map.x - 0.5F, in_map.y - 0.5F);
  const V2f first(std::floor(corner.x), std::floor(corner.y));
  const auto last = static_cast<float>(view.size - 3);
  if (!(first.x >= 1 && first.y >= 1 && first.x <= last && first.y <= last)) return 1;
  const V2f part = corner - first;
  const std::array<float, 4> columns{1 - part.x, 1, 1, part.x};
  const std::array<float, 4> rows{1 - part.y, 1, 1, part.y};
  const std::size_t size = view.size;
  const float* depths =
      &map.depths[(static_cast<std::size_t>(first.y) - 1) * size + static_cast<std::size_t>(first.x) - 1];
  float sum = 0;
  for (std::size_t j = 0; j < 4; ++j) {
    float row = 0;
    for (std::size_t i = 0; i < 4; ++i) row += depths[j * size + i] >= in_map.z ? columns[i] : 0.0F;
    sum += row * rows[j];
  }
  return sum / 9;
}

}  // namespace selvedge
