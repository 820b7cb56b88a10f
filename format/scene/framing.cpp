#include "format/scene/framing.h"

#include <Imath/ImathBox.h>
#include <Imath/ImathBoxAlgo.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "format/base/guard.h"

namespace selvedge {
namespace {

using Box = Imath::Box3d;

constexpr double stray_area = 0.01;   ///< fraction beyond either end of the bulk
constexpr double stray_distance = 2;  ///< of the bulk's diagonal
constexpr double beside_distance = 0.5;
constexpr std::size_t max_sampled = std::size_t{1} << 16;  ///< triangles, about
/// Area that the front shows, beside what the best side does, below which that side is shown.
constexpr double min_shown = 0.2;

struct Sample {
  std::array<V3d, 3> corners;
  V3d normal;  ///< as long as the area
};

V3d corner_of(const Scene& scene, const SceneInstance& instance, std::size_t k) {
  const ScenePrimitive& primitive = scene.primitives[instance.primitive];
  return V3d(primitive.positions[primitive.indices[k]]) * instance.world;
}

/// World positions of vertices that triangles use.
std::vector<V3d> points_of(const Scene& scene, const SceneInstance& part) {
  const ScenePrimitive& primitive = scene.primitives[part.primitive];
  std::vector<std::uint8_t> used(primitive.positions.size());
  for (const std::uint32_t index : primitive.indices) used[index] = 1;
  std::vector<V3d> points;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i] != 0) points.push_back(V3d(primitive.positions[i]) * part.world);
  }
  return points;
}

std::vector<Sample> samples_of(const Scene& scene, const std::vector<const SceneInstance*>& cloth) {
  std::size_t triangles = 0;
  for (const SceneInstance* part : cloth) triangles += scene.primitives[part->primitive].indices.size() / 3;
  const std::size_t step = triangles / max_sampled + 1;
  std::vector<Sample> samples;
  for (const SceneInstance* part : cloth) {
    for (std::size_t k = 0; k + 2 < scene.primitives[part->primitive].indices.size(); k += 3 * step) {
      const V3d a = corner_of(scene, *part, k);
      const V3d b = corner_of(scene, *part, k + 1);
      const V3d c = corner_of(scene, *part, k + 2);
      samples.push_back({{a, b, c}, (b - a).cross(c - a) * 0.5});
    }
  }
  return samples;
}

/// The box of all but stray_area of the area at either end of each axis.
Box bulk_of(const std::vector<Sample>& samples) {
  Box bulk;
  std::vector<std::pair<double, double>> along;  // place, area
  for (int axis = 0; axis < 3; ++axis) {
    along.clear();
    double whole = 0;
    for (const Sample& sample : samples) {
      const double area = sample.normal.length() / 3;
      for (const V3d& corner : sample.corners) along.emplace_back(corner[axis], area);
      whole += 3 * area;
    }
    if (!(whole > 0)) return {};
    std::ranges::sort(along);
    double sum = 0;
    bulk.min[axis] = HUGE_VAL;
    for (const auto& [place, area] : along) {
      sum += area;
      if (sum > stray_area * whole) bulk.min[axis] = std::min(bulk.min[axis], place);
      bulk.max[axis] = place;
      if (sum >= (1 - stray_area) * whole) break;
    }
  }
  return bulk;
}

Box grown(const Box& box, double by) { return {box.min - V3d(by), box.max + V3d(by)}; }

/// The direction that most of the area faces: of the largest part of normals along it, on their side.
V3d broad_side(const std::vector<Sample>& samples) {
  Imath::M33d spread(0, 0, 0, 0, 0, 0, 0, 0, 0);
  V3d sum(0, 0, 0);
  for (const auto& [corners, normal] : samples) {
    const double area = normal.length();
    if (!(area > 0)) continue;
    sum += normal;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) spread[i][j] += normal[i] * normal[j] / area;
    }
  }
  V3d side(0.5, 0.7, 0.6);
  for (int i = 0; i < 64; ++i) side = (side * spread).normalized();
  return side.dot(sum) < 0 ? -side : side;
}

double shown_area(const std::vector<Sample>& samples, const V3d& side) {
  double sum = 0;
  for (const Sample& sample : samples) sum += std::abs(sample.normal.dot(side));
  return sum;
}

}  // namespace

Result<Framing> frame_scene(const Scene& scene) {
  return result_of([&] {
    Framing framing;
    value_or_throw(world_points(scene));
    const auto has_fabric = [&](const SceneInstance& part) {
      const int material = scene.primitives[part.primitive].material;
      return material >= 0 && scene.materials[material].fabric.has_value();
    };
    const bool has_cloth = std::ranges::any_of(scene.instances, has_fabric);
    std::vector<const SceneInstance*> cloth;
    for (const SceneInstance& part : scene.instances) {
      if (!has_cloth || has_fabric(part)) cloth.push_back(&part);
    }
    const std::vector<Sample> samples = samples_of(scene, cloth);
    const Box bulk = bulk_of(samples);
    const Box near = bulk.isEmpty() ? Box(V3d(-HUGE_VAL), V3d(HUGE_VAL))
                                    : grown(bulk, stray_distance * bulk.size().length());
    Box left_out;
    const auto frame = [&](const SceneInstance& part, const Box& within, bool whole) {
      std::vector<V3d> points = points_of(scene, part);
      double stray = 0;
      for (const V3d& point : points)
        stray = std::max(stray, (point - closestPointInBox(point, near)).length());
      if (stray > 0) {
        framing.strays.push_back(
            fmt::format("{} reaches {:.3g} m away from the rest: the frame leaves that out",
                        scene.primitives[part.primitive].name, stray));
      }
      const auto beyond = std::partition(points.begin(), points.end(),
                                         [&](const V3d& point) { return within.intersects(point); });
      const auto end = whole && beyond != points.end() ? points.begin() : beyond;
      framing.points.insert(framing.points.end(), points.begin(), end);
      std::for_each(end, points.end(), [&](const V3d& point) { left_out.extendBy(point); });
    };
    for (const SceneInstance* part : cloth) frame(*part, near, false);
    Box beside;
    for (const V3d& point : framing.points) beside.extendBy(point);
    beside = grown(beside, beside_distance * beside.size().length());
    for (const SceneInstance& part : scene.instances) {
      if (has_cloth && !has_fabric(part)) frame(part, beside, true);
    }
    for (int i = 0; i < 8 && !left_out.isEmpty(); ++i) {
      framing.left_out.emplace_back(i % 2 == 0 ? left_out.min.x : left_out.max.x,
                                    i / 2 % 2 == 0 ? left_out.min.y : left_out.max.y,
                                    i < 4 ? left_out.min.z : left_out.max.z);
    }
    const V3d side = broad_side(samples);
    if (shown_area(samples, V3d(0, 0, 1)) < min_shown * shown_area(samples, side)) {
      framing.azimuth = std::atan2(side.x, side.z) / radians_per_degree;
      framing.elevation = std::asin(std::clamp(side.y, -1.0, 1.0)) / radians_per_degree;
      framing.turned = fmt::format(
          "the front shows the cloth edge-on: it is seen from --azimuth {:.0f} --elevation {:.0f}",
          framing.azimuth, framing.elevation);
    }
    return framing;
  });
}

void show_depths(std::span<const V3d> points, Camera& camera) {
  const double depth = camera.far - camera.near;
  for (const V3d& point : points) {
    const double at = (camera.position - point).dot(camera.back());
    camera.far = std::max(camera.far, at * 1.01 + 1e-3 * depth);
    camera.near = std::min(camera.near, at - 1e-3 * depth);
  }
  if (camera.projection == Projection::perspective) camera.near = std::max(camera.near, camera.far * 1e-4);
}

}  // namespace selvedge
