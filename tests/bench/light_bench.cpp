// Light of yarn by lines (converter/light/line_light.h), or a fabric's of the same stitch, beside light
// traced along paths from the places that no other yarn covers, weighted by how they are seen, under 64
// lights: relative L2, in which the noise of two sets of paths cancels, ratio of means, relative L2 of the
// moments.
//
//   selvedge-light STITCH [PATHS [SEED [FABRIC]]]
#include <fmt/format.h>
#include <Eigen/LU>

#include <ctime>
#include <numbers>

#include "converter/bake/setup.h"
#include "converter/light/line_light.h"
#include "converter/light/path_tracer.h"
#include "converter/light/station_fit.h"
#include "converter/stitch/find_cell.h"
#include "format/base/guard.h"
#include "format/base/parallel.h"
#include "format/fabric/file.h"

namespace {

using namespace selvedge;
using std::numbers::pi;

constexpr int light_count = 64;
constexpr double lift = 0.15;  // radii above a place, where a ray starts that looks for the surface

std::vector<V3f> spiral_lights(double first_turn) {
  std::vector<V3f> lights;
  for (int i = 0; i < light_count; ++i) {
    const double z = (i + 0.5) / light_count;
    const double turn = first_turn + i * pi * (3 - std::sqrt(5.0));
    lights.emplace_back(V3d(std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z));
  }
  return lights;
}

/// Whether a ray from above the place meets its own surface, past hairs.
bool is_open(const TracedCell& cell, const StationPoint& place, SurfacePoint& point) {
  const V3d normal(place.normal);
  const auto radius = static_cast<double>(place.radius);
  const V3d above = V3d(place.position) + normal * (lift * radius);
  V3d from = above / cell.mm_per_unit;
  do {
    if (!cell.scene.trace(from, -normal, point)) return false;
    from = V3d(point.position) - normal * (1e-3 * radius / cell.mm_per_unit);
  } while (point.hair_point >= 0);
  if (point.is_back) return false;
  V3d off = V3d(point.position) * cell.mm_per_unit - above;
  const V2d period = cell.scene.period() * cell.mm_per_unit;
  for (int k = 0; k < 2; ++k) off[k] -= std::round(off[k] / period[k]) * period[k];
  return std::abs(off.length() - lift * radius) < 0.1 * radius;
}

/// Irradiance by way of others under each light, and the moments along `fibre` of the light of one
/// reflection.
struct Arrived {
  Eigen::MatrixX3d irradiance = Eigen::MatrixX3d::Zero(light_count, 3);
  std::array<double, light_moment_count> moments{};
};
Arrived arrived_at(const RayScene& scene, const SurfacePoint& point, const V3d& fibre,
                   std::span<const V3f> lights, int paths, std::uint64_t seed) {
  Arrived arrived;
  const PathTracer tracer(scene, scene.is_translucent() ? unlimited_bounces : 2);
  Eigen::MatrixX3d sums = Eigen::MatrixX3d::Zero(light_count, 3);
  std::vector<V3d> radiance(light_count, V3d(0, 0, 0));
  for (int path = 0; path < paths; ++path) {
    PathSampler sampler(static_cast<std::uint32_t>(path), seed);
    const V3d direction = cosine_direction(V3d(point.face_normal), sampler.next_pair());
    SurfacePoint met;
    if (!scene.trace(scene.offset_origin(point), direction, met)) continue;
    const YarnBrdf surface = brdf_at(scene, met);
    const double x = direction.dot(fibre);
    for (int l = 0; l < light_count; ++l) {
      const V3d direct = direct_light(scene, met, surface, lights[l], -direction);
      radiance[l] += direct;
      sums.row(l) += Eigen::RowVector3d(1, 2 * x, 4 * x * x - 1) * (direct.x + direct.y + direct.z);
    }
    tracer.add_indirect(met, -direction, lights, sampler, radiance);
  }
  for (int l = 0; l < light_count; ++l)
    for (int c = 0; c < 3; ++c) arrived.irradiance(l, c) = radiance[l][c] * pi / paths;
  const double all = sums.col(0).squaredNorm();
  for (int n = 0; n < light_moment_count && all > 0; ++n)
    arrived.moments[n] = sums.col(0).dot(sums.col(n + 1)) / all;
  return arrived;
}

/// A place that no other yarn covers, and its light along two independent sets of paths.
struct TracedPlace {
  int station = 0;  ///< among all curves'
  StationPoint point;
  std::array<LightColumns, 2> light{LightColumns::Zero(), LightColumns::Zero()};
};

LightColumns light_along_paths(const TracedCell& cell, const YarnCurve& curve, const V3d& along,
                               const SurfacePoint& point, int paths, std::uint64_t seed) {
  static const std::vector<V3f> lights = spiral_lights(0);
  static const Eigen::MatrixXd project = [] {
    Eigen::MatrixXd by_light(light_count, yarn_light_function_count);
    for (int l = 0; l < light_count; ++l) {
      const auto basis = light_basis(lights[l]);
      for (int k = 0; k < yarn_light_function_count; ++k) by_light(l, k) = static_cast<double>(basis[k]);
    }
    return Eigen::MatrixXd((by_light.transpose() * by_light).inverse() * by_light.transpose());
  }();
  const Gloss& gloss = curve.gloss;
  const V3f reflected =
      curve.albedo * (1 - gloss.weight) + V3f(gloss.weight * mean_gloss_albedo(gloss.roughness));
  LightColumns light = LightColumns::Zero();
  std::array<double, 2> mean{};
  const auto add = [&](const SurfacePoint& on, const V3f& weight, int from) {
    V3d fibre = brdf_at(cell.scene, on).fibre_direction;
    if (fibre.dot(along) < 0) fibre = -fibre;
    const Arrived arrived = arrived_at(cell.scene, on, fibre, lights, paths, seed_of(seed, 7, from));
    const Eigen::MatrixXd values = project * arrived.irradiance;
    for (int k = 0; k < light_columns; ++k)
      light[k] += values(k / 3, k % 3) * static_cast<double>(weight[k % 3]) / pi;
    for (int i = 0; i < 3; ++i)
      mean[from] += arrived.irradiance.col(i).mean() * static_cast<double>(weight[i]);
    if (from > 0 || gloss.lustre == 0) return;
    for (int n = 0; n < light_moment_count; ++n) light[2 * light_columns + n] = arrived.moments[n];
  };
  add(point, reflected, 0);
  // No ray met its other side: without the noise of its fibres.
  if (cell.scene.is_translucent()) {
    const SurfacePoint inside = other_side(point);
    const YarnBrdf wall = brdf_at(cell.scene, inside);
    add(inside, V3f(wall.albedo * (wall.diffuse_factor * wall.transmission * diffuse_weight(wall))), 1);
  }
  light.tail(light_moment_count) *= mean[0] > 0 ? mean[0] / (mean[0] + mean[1]) : 0;
  return light;
}

std::vector<TracedPlace> trace_places(const TracedCell& cell, const Yarns& yarns, int paths,
                                      std::uint64_t seed) {
  std::vector<TracedPlace> all;
  for (int c = 0; c < static_cast<int>(yarns.data().curves.size()); ++c) {
    const YarnCurve& curve = yarns.data().curves[c];
    std::vector<std::vector<TracedPlace>> places(curve.stations);
    parallel_for(0, curve.stations, [&](int station) {
      const V3d along(yarns.frame_at(c, station).tangent);
      const int number = yarns.geometry().first_station[c] + station;
      for (const StationPoint& at :
           points_around_station(yarns, c, station, curve.plies.count == 1 ? 16 : 48 / curve.plies.count)) {
        SurfacePoint point;
        if (!is_open(cell, at, point)) continue;
        TracedPlace& place = places[station].emplace_back(number, at);
        for (int i = 0; i < 2; ++i)
          place.light[i] = light_along_paths(cell, curve, along, point, paths,
                                             seed_of(2 * seed + i, number, places[station].size()));
      }
    });
    for (const auto& of_station : places) all.insert(all.end(), of_station.begin(), of_station.end());
  }
  return all;
}

/// Errors whose noise is independent in both factors: its mean is 0.
void compare(const YarnData& data, const std::vector<TracedPlace>& places) {
  struct Sums {
    double error = 0, signal = 0, light = 0, truth = 0;
    void add(double w, double shown, double a, double b) {
      error += w * (shown - a) * (shown - b);
      signal += w * a * b;
      light += w * shown;
      truth += w * (a + b) / 2;
    }
  } all, moments;
  const std::vector<V3f> lights = spiral_lights(1);
  for (const TracedPlace& place : places) {
    const float* value = &data.station_light.at(std::size_t{light_values_per_station} * place.station);
    std::array<LightTransfer, 3> transfer{};
    std::array<double, light_moment_count> moment{};
    for (const float function : place.point.functions)
      for (float& sum : transfer[0]) sum += function * *value++;
    for (double& sum : moment)
      for (const float function : place.point.functions) sum += static_cast<double>(function * *value++);
    for (int i = 0; i < 2; ++i)
      for (int k = 0; k < light_columns; ++k) transfer[i + 1][k] = static_cast<float>(place.light[i][k]);
    const auto weight = static_cast<double>(place.point.visible_fraction);
    for (const V3f& l : lights) {
      const std::array light{V3d(indirect_light(transfer[0], l)), V3d(indirect_light(transfer[1], l)),
                             V3d(indirect_light(transfer[2], l))};
      for (int k = 0; k < 3; ++k) all.add(weight, light[0][k], light[1][k], light[2][k]);
    }
    for (int n = 0; n < light_moment_count; ++n)
      moments.add(weight, moment[n], place.light[0][2 * light_columns + n],
                  place.light[1][2 * light_columns + n]);
  }
  fmt::print("rel. L2 {:.3f}, mean {:.3f}, moments {:.2f}\n", std::sqrt(all.error / all.signal),
             all.light / all.truth, std::sqrt(moments.error / std::max(moments.signal, 1e-30)));
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::string stitch = argc > 1 ? argv[1] : "plain-knit";
    const int paths = argc > 2 ? std::atoi(argv[2]) : 128;
    const std::uint64_t seed = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1;
    const Cell found = value_or_throw(find_cell(stitch));
    const TracedCell cell = value_or_throw(trace_cell(found.mesh, stitch));
    YarnCell yarn = yarn_cell_of(found.mesh);
    YarnData lines = yarn.yarns;
    const std::clock_t begin = std::clock();
    compute_yarn_light(lines, V2f(yarn.period), yarn.wall_transmission);
    fmt::print("{}: lines {:.2f} CPU s\n", stitch,
               static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
    if (argc > 4)
      lines.station_light = value_or_throw(read_fabric(argv[4])).levels.front().yarns()->data().station_light;
    compare(lines, trace_places(cell, Yarns(lines, V2f(yarn.period)), paths, seed));
  } catch (const Failure& failure) {
    fmt::print(stderr, "{}\n", to_line(failure.error));
    return 1;
  }
}
