// Surfaces that a ray through a pixel meets, plainly: the index passes are held to it.
#pragma once

#include <algorithm>
#include <array>
#include <optional>

#include "format/scene/camera.h"
#include "viewer/scene/mesh.h"

namespace selvedge::test {

/// The first hit of a ray from the viewer, by going through all triangles in double precision.
struct RayHit {
  double distance = 0;
  std::size_t triangle = 0;
  V3d normal;  ///< of the triangle's plane, not unit
};

class RayCaster {
 public:
  RayCaster(const MergedSurfaces& mesh, const V2i& size, const Camera& camera)
      : mesh_(mesh), size_(size), camera_(camera) {}

  /// x, y: pixel coordinates from the frame's lower left corner.
  std::optional<RayHit> cast(double x, double y) const { return cast(camera_.position, -view(x, y)); }

  /// From any place, by a direction that need not be unit.
  std::optional<RayHit> cast(const V3d& from, const V3d& away) const {
    std::optional<RayHit> nearest;
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
      const V3d a = corner(i, 0);
      const V3d normal = (corner(i, 1) - a).cross(corner(i, 2) - a);
      const double t = (a - from).dot(normal) / away.dot(normal);
      if (!(t > 0) || (nearest && t >= nearest->distance)) continue;
      const V3d b = barycentric(i, from + away * t);
      if (std::min({b.x, b.y, b.z}) >= 0) nearest = RayHit{t, i, normal};
    }
    return nearest;
  }

  /// Texture coordinates where the ray meets the plane of a triangle.
  V2d uv(std::size_t triangle, double x, double y) const {
    return {attributes(triangle, x, y, 0)[3], attributes(triangle, x, y, 1)[3]};
  }

  /// A group of the corners' attributes, interpolated in the plane of the triangle.
  std::array<double, 4> attributes(std::size_t triangle, double x, double y, std::size_t group) const {
    const V3d b = at_plane(triangle, x, y);
    std::array<double, 4> sum{};
    for (unsigned k = 0; k < 3; ++k) {
      const Group& value = mesh_.attributes[mesh_.triangles[triangle].corners[k]][group];
      for (std::size_t i = 0; i < 4; ++i) sum[i] += static_cast<double>(value[i]) * b[static_cast<int>(k)];
    }
    return sum;
  }

  /// Smallest barycentric coordinate at the ray: how far inside it is.
  double inside(std::size_t triangle, double x, double y) const {
    const V3d b = at_plane(triangle, x, y);
    return std::min({b.x, b.y, b.z});
  }

 private:
  /// Barycentric coordinates where the ray meets the plane of a triangle.
  V3d at_plane(std::size_t triangle, double x, double y) const {
    const V3d away = -view(x, y);
    const V3d a = corner(triangle, 0);
    const V3d normal = (corner(triangle, 1) - a).cross(corner(triangle, 2) - a);
    const double t = (a - camera_.position).dot(normal) / away.dot(normal);
    return barycentric(triangle, camera_.position + away * t);
  }

  V3d view(double x, double y) const {
    return view_direction(camera_, V2d(2 * x / size_.x - 1, 2 * y / size_.y - 1));
  }
  V3d corner(std::size_t triangle, std::size_t k) const {
    return V3d(mesh_.positions[mesh_.triangles[triangle].corners[k]]);
  }
  V3d barycentric(std::size_t triangle, const V3d& p) const {
    const V3d a = corner(triangle, 0);
    const V3d b = corner(triangle, 1);
    const V3d c = corner(triangle, 2);
    const V3d normal = (b - a).cross(c - a);
    const double area = normal.length2();
    const double l1 = (p - a).cross(c - a).dot(normal) / area;
    const double l2 = (b - a).cross(p - a).dot(normal) / area;
    return {1 - l1 - l2, l1, l2};
  }

  const MergedSurfaces& mesh_;
  V2i size_;
  const Camera& camera_;
};

}  // namespace selvedge::test
