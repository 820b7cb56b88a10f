#include "format/scene/framing.h"

#include <Imath/ImathBoxAlgo.h>
#include <Imath/ImathMatrixAlgo.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "format/base/guard.h"

namespace selvedge {
namespace {

constexpr double stray_area = 0.01;   ///< fraction beyond either end of the bulk
constexpr double stray_distance = 2;  ///< of the bulk's diagonal
constexpr double beside_distance = 0.5;
constexpr std::size_t max_sampled = std::size_t{1} << 16;  ///< triangles, about
/// Fractions of the area that the best side shows, and the best one without looking up or down: a front with
/// less is not shown. Garments that face +x have half of it and less, others the whole.
constexpr double min_shown = 0.2;
constexpr double min_upright = 0.6;

struct Sample {
  std::array<V3d, 3> corners;
  V3d normal;  ///< as long as the area
};

std::vector<Sample> samples_of(const Scene& scene, const SceneParts& cloth) {
  std::size_t triangles = 0;
  for (const SceneInstance* part : cloth) triangles += scene.primitives[part->primitive].indices.size() / 3;
  const std::size_t step = triangles / max_sampled + 1;
  std::vector<Sample> samples;
  for (const SceneInstance* part : cloth) {
    const ScenePrimitive& primitive = scene.primitives[part->primitive];
    for (std::size_t i = 0; i + 2 < primitive.indices.size(); i += 3 * step) {
      std::array<V3d, 3> corners;
      for (std::size_t k = 0; k < 3; ++k)
        corners[k] = V3d(primitive.positions[primitive.indices[i + k]]) * part->world;
      const auto& [a, b, c] = corners;
      samples.push_back({corners, (b - a).cross(c - a) * 0.5});
    }
  }
  return samples;
}

double shown_area(const std::vector<Sample>& samples, const V3d& side) {
  double sum = 0;
  for (const Sample& sample : samples) sum += std::abs(sample.normal.dot(side));
  return sum;
}

/// The direction that most of the area faces, a horizontal one if `upright`: of the largest part of normals
/// along it, on their side; where they cancel, as on a tube, upwards, forwards and to the right.
V3d broad_side(const std::vector<Sample>& samples, bool upright) {
  Imath::M33d spread(0, 0, 0, 0, 0, 0, 0, 0, 0);
  V3d sum(0, 0, 0);
  for (const auto& [corners, whole] : samples) {
    const V3d normal(whole.x, upright ? 0 : whole.y, whole.z);
    const double area = normal.length();
    if (!(area > 0)) continue;
    sum += normal;
    spread += Imath::outerProduct(normal, normal / area);
  }
  V3d side(0.5, 0.7, 0.6);
  for (int i = 0; i < 64; ++i) side = (side * spread).normalized();
  const bool cancels = std::abs(side.dot(sum)) < 0.5 * shown_area(samples, side);
  return side.dot(cancels ? V3d(1) : sum) < 0 ? -side : side;
}

}  // namespace

Imath::Box3d bulk_box(const Scene& scene, const SceneParts& parts) {
  const std::vector<Sample> samples = samples_of(scene, parts);
  Imath::Box3d bulk;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<std::pair<double, double>> along;  // place, area
    double whole = 0;
    for (const Sample& sample : samples) {
      const double area = sample.normal.length() / 3;
      for (const V3d& corner : sample.corners) along.emplace_back(corner[axis], area);
      whole += 3 * area;
    }
    if (!(whole > 0)) return {};
    std::ranges::sort(along);
    double sum = 0;
    for (const auto& [place, area] : along) {
      if (sum <= stray_area * whole) bulk.min[axis] = place;
      if (sum < (1 - stray_area) * whole) bulk.max[axis] = place;
      sum += area;
    }
  }
  return bulk;
}

double stray_distance_of(const V3d& point, const Imath::Box3d& bulk) {
  if (bulk.isEmpty()) return 0;
  const double away = (point - closestPointInBox(point, bulk)).length();
  return away > stray_distance * bulk.size().length() ? away : 0;
}

std::vector<V3d> used_points(const Scene& scene, const SceneInstance& part) {
  const ScenePrimitive& primitive = scene.primitives[part.primitive];
  std::vector<bool> used(primitive.positions.size());
  for (const std::uint32_t index : primitive.indices) used[index] = true;
  std::vector<V3d> points;
  for (std::size_t i = 0; i < used.size(); ++i)
    if (used[i]) points.push_back(V3d(primitive.positions[i]) * part.world);
  return points;
}

Result<Framing> frame_scene(const Scene& scene) {
  return catch_failure([&] {
    Framing framing;
    value_or_throw(world_points(scene));
    const auto has_fabric = [&](const SceneInstance& part) {
      const int material = scene.primitives[part.primitive].material;
      return material >= 0 && scene.materials[material].fabric.has_value();
    };
    const bool has_cloth = std::ranges::any_of(scene.instances, has_fabric);
    SceneParts cloth;
    for (const SceneInstance& part : scene.instances)
      if (!has_cloth || has_fabric(part)) cloth.push_back(&part);
    const std::vector<Sample> samples = samples_of(scene, cloth);
    const Imath::Box3d bulk = bulk_box(scene, cloth);
    Imath::Box3d left_out;
    const auto frame = [&](const SceneInstance& part, bool whole, const auto& inside) {
      std::vector<V3d> points = used_points(scene, part);
      double stray = 0;
      for (const V3d& point : points) stray = std::max(stray, stray_distance_of(point, bulk));
      if (stray > 0)
        framing.stray_remarks.push_back(
            fmt::format("{} reaches {:.3g} m away from the rest: the frame leaves that out",
                        scene.primitives[part.primitive].name, stray));
      const auto beyond = std::partition(points.begin(), points.end(), inside);
      const auto end = whole && beyond != points.end() ? points.begin() : beyond;
      framing.points.insert(framing.points.end(), points.begin(), end);
      std::for_each(end, points.end(), [&](const V3d& point) { left_out.extendBy(point); });
    };
    for (const SceneInstance* part : cloth)
      frame(*part, false, [&](const V3d& point) { return stray_distance_of(point, bulk) == 0; });
    Imath::Box3d beside = bounding_box(framing.points);
    const V3d margin(beside_distance * beside.size().length());
    beside = Imath::Box3d(beside.min - margin, beside.max + margin);
    for (const SceneInstance& part : scene.instances)
      if (has_cloth && !has_fabric(part))
        frame(part, true, [&](const V3d& point) { return beside.intersects(point); });
    const std::array<V3d, 2> ends{left_out.min, left_out.max};
    for (std::size_t i = 0; i < 8 && !left_out.isEmpty(); ++i)
      framing.excluded_corners.emplace_back(ends[i % 2].x, ends[i / 2 % 2].y, ends[i / 4].z);
    const double shown = shown_area(samples, V3d(0, 0, 1));
    for (const auto& [upright, fraction] : {std::pair(false, min_shown), {true, min_upright}}) {
      const V3d side = broad_side(samples, upright);
      if (!framing.turn_remark.empty() || shown >= fraction * shown_area(samples, side)) continue;
      const bool is_steep = std::abs(side.y) > 0.999;
      framing.azimuth = is_steep ? 0 : std::atan2(side.x, side.z) / radians_per_degree;
      framing.elevation = std::asin(std::clamp(side.y, -1.0, 1.0)) / radians_per_degree;
      framing.turn_remark =
          fmt::format("the front shows the cloth {}: it is seen from --azimuth {:.0f} --elevation {:.0f}",
                      upright ? "from its narrow side" : "edge-on", framing.azimuth, framing.elevation);
    }
    if (framing.turn_remark.empty() && scene.front_azimuth != 0) {
      framing.azimuth = scene.front_azimuth;
      framing.turn_remark =
          fmt::format("VRM 0 faces -z: it is seen from --azimuth {:.0f}", scene.front_azimuth);
    }
    return framing;
  });
}

void widen_clipping_depths(std::span<const V3d> points, Camera& camera) {
  const double depth = camera.far - camera.near;
  for (const V3d& point : points) {
    const double at = (camera.position - point).dot(camera.image_normal());
    camera.far = std::max(camera.far, at * 1.01 + 1e-3 * depth);
    camera.near = std::min(camera.near, at - 1e-3 * depth);
  }
  if (camera.projection == Projection::perspective) camera.near = std::max(camera.near, camera.far * 1e-4);
}

}  // namespace selvedge
