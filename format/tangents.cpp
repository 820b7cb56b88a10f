#include "format/tangents.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace selvedge {
namespace {

/// Directions of growing u in space, and whether the picture is upright (+1) or mirrored (-1); sign 0 where
/// the triangle has no area in the plane of the texture.
struct Gradient {
  V3d du{0, 0, 0};
  int sign = 0;
};

Gradient gradient_of(const std::array<V3d, 3>& p, const std::array<V2d, 3>& uv) {
  const V3d e1 = p[1] - p[0];
  const V3d e2 = p[2] - p[0];
  const V2d d1 = uv[1] - uv[0];
  const V2d d2 = uv[2] - uv[0];
  const double area = d1.x * d2.y - d1.y * d2.x;
  if (area == 0 || !std::isfinite(area)) return {};
  const V3d du = (e1 * d2.y - e2 * d1.y) * (area > 0 ? 1.0 : -1.0);
  if (du.length2() == 0) return {};
  // dP/du x dP/dv has the sign of the area times the face normal, and v falls where the picture rises.
  return {du.normalized(), area > 0 ? -1 : 1};
}

double angle_between(const V3d& a, const V3d& b) { return std::atan2(a.cross(b).length(), a.dot(b)); }

/// `direction` without its part along the unit vector `normal`.
V3d flattened(const V3d& direction, const V3d& normal) { return direction - normal * direction.dot(normal); }

V3d any_perpendicular(const V3d& normal) {
  const V3d axis = std::abs(normal.x) < 0.9 ? V3d(1, 0, 0) : V3d(0, 1, 0);
  const V3d flat = flattened(axis, normal);
  return flat.length2() > 0 ? flat.normalized() : axis;
}

}  // namespace

Tangents compute_tangents(std::span<const V3f> positions, std::span<const V3f> normals,
                          std::span<const V2d> tex_coords, std::span<const std::uint32_t> indices) {
  constexpr std::uint32_t none = ~std::uint32_t{0};
  const std::size_t count = positions.size();
  Tangents result;
  result.indices.assign(indices.begin(), indices.end());

  // A vertex takes the sign of the first triangle that has one; triangles of the other sign use its copy.
  std::vector<int> signs(count, 0);
  std::vector<std::uint32_t> copies(count, none);
  std::vector<V3d> sums(count, V3d(0, 0, 0));
  for (std::size_t t = 0; t + 2 < indices.size(); t += 3) {
    std::array<V3d, 3> p;
    std::array<V2d, 3> uv;
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = V3d(positions[indices[t + k]]);
      uv[k] = tex_coords[indices[t + k]];
    }
    const Gradient gradient = gradient_of(p, uv);
    if (gradient.sign == 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t old = indices[t + k];
      std::uint32_t vertex = old;
      if (signs[old] == 0) signs[old] = gradient.sign;
      if (signs[old] != gradient.sign) {
        if (copies[old] == none) {
          copies[old] = static_cast<std::uint32_t>(count + result.copy_of.size());
          result.copy_of.push_back(old);
          signs.push_back(gradient.sign);
          sums.emplace_back(0, 0, 0);
        }
        vertex = copies[old];
        result.indices[t + k] = vertex;
      }
      const V3d normal(normals[old]);
      const V3d flat = flattened(gradient.du, normal);
      if (flat.length2() == 0) continue;
      const double angle =
          angle_between(flattened(p[(k + 1) % 3] - p[k], normal), flattened(p[(k + 2) % 3] - p[k], normal));
      sums[vertex] += flat.normalized() * angle;
    }
  }

  result.tangents.resize(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) {
    const std::size_t old = v < count ? v : result.copy_of[v - count];
    const V3d normal(normals[old]);
    const V3d tangent = sums[v].length2() > 1e-24 ? sums[v].normalized() : any_perpendicular(normal);
    result.tangents[v] = V4f(static_cast<float>(tangent.x), static_cast<float>(tangent.y),
                             static_cast<float>(tangent.z), signs[v] < 0 ? -1.0F : 1.0F);
  }
  return result;
}

}  // namespace selvedge
