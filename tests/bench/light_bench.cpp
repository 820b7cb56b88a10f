// Light of yarn by lines (converter/light/line_light.h) beside light traced along paths: relative L2 over
// places about all stations, by how they are seen, and 64 lights; ratio of means; relative L2 of the moments;
// CPU seconds.
//
//   selvedge-light STITCH [PATHS [SEED]]
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

namespace {

using namespace selvedge;
using std::numbers::pi;

constexpr int light_count = 64;
constexpr double covered_weight = 0.05;
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
  const V3d above = V3d(place.place) + normal * (lift * radius);
  V3d from = above / cell.mm;
  do {
    if (!cell.scene.trace(from, -normal, point)) return false;
    from = V3d(point.position) - normal * (1e-3 * radius / cell.mm);
  } while (point.hair >= 0);
  if (point.back) return false;
  V3d off = V3d(point.position) * cell.mm - above;
  const V2d period = cell.scene.period() * cell.mm;
  for (int k = 0; k < 2; ++k) off[k] -= std::round(off[k] / period[k]) * period[k];
  return std::abs(off.length() - lift * radius) < 0.1 * radius;
}

/// Irradiance by way of others under each light, and the moments along `fibre` of the light of one
/// reflection.
struct Arrived {
  Eigen::MatrixX3d irradiance = Eigen::MatrixX3d::Zero(light_count, 3);
  std::array<double, light_moments> moments{};
};
Arrived arrived_at(const RayScene& scene, const SurfacePoint& point, const V3d& fibre,
                   std::span<const V3f> lights, int paths, std::uint64_t seed) {
  Arrived arrived;
  const PathTracer tracer(scene, scene.is_translucent() ? unlimited_bounces : 2);
  Eigen::MatrixX3d sums = Eigen::MatrixX3d::Zero(light_count, 3);
  std::vector<V3d> radiance(light_count, V3d(0, 0, 0));
  std::uint64_t rays = 0;
  for (int path = 0; path < paths; ++path) {
    PathSampler sampler(static_cast<std::uint32_t>(path), seed);
    const V3d direction = cosine_direction(V3d(point.face_normal), sampler.next());
    SurfacePoint met;
    if (!scene.trace(scene.leave(point), direction, met)) continue;
    const YarnBrdf surface = surface_at(scene, met);
    const double x = direction.dot(fibre);
    for (int l = 0; l < light_count; ++l) {
      const V3d direct = direct_light(scene, met, surface, lights[l], -direction, rays);
      radiance[l] += direct;
      sums.row(l) += Eigen::RowVector3d(1, 2 * x, 4 * x * x - 1) * (direct.x + direct.y + direct.z);
    }
    tracer.add_indirect(met, -direction, lights, sampler, radiance);
  }
  for (int l = 0; l < light_count; ++l) {
    for (int c = 0; c < 3; ++c) arrived.irradiance(l, c) = radiance[l][c] * pi / paths;
  }
  const double all = sums.col(0).squaredNorm();
  for (int n = 0; n < light_moments && all > 0; ++n)
    arrived.moments[n] = sums.col(0).dot(sums.col(n + 1)) / all;
  return arrived;
}

/// data.light along `paths` from each place around every station; [1, 2] of the seeds are independent.
void trace_yarn_light(const TracedCell& cell, int paths, std::uint64_t seed, YarnData& data) {
  const std::vector<V3f> lights = spiral_lights(0);
  Eigen::MatrixXd by_light(light_count, light_functions_of_yarn);
  for (int l = 0; l < light_count; ++l) {
    const auto basis = light_basis(lights[l]);
    for (int k = 0; k < light_functions_of_yarn; ++k) by_light(l, k) = static_cast<double>(basis[k]);
  }
  const Eigen::MatrixXd project = (by_light.transpose() * by_light).inverse() * by_light.transpose();
  const Yarns yarns(data, V2f(cell.scene.period() * cell.mm));
  int first = 0;
  for (int c = 0; c < static_cast<int>(data.curves.size()); ++c) {
    const YarnCurve& curve = data.curves[c];
    const Gloss& gloss = curve.gloss;
    const V3f reflected =
        curve.albedo * (1 - gloss.weight) + V3f(gloss.weight * mean_gloss_albedo(gloss.roughness));
    std::vector<std::vector<LitPlace>> places(curve.stations);
    parallel_for(0, curve.stations, [&](int station) {
      const V3d along(yarns.frame_at(c, station).tangent);
      for (const StationPoint& at :
           points_about(yarns, c, station, curve.plies.count == 1 ? 16 : 48 / curve.plies.count)) {
        LitPlace& place = places[station].emplace_back();
        place.station = station;
        for (int i = 0; i < angle_functions; ++i) place.functions[i] = static_cast<double>(at.functions[i]);
        place.light.setZero();
        place.weight = covered_weight;
        SurfacePoint point;
        place.open = is_open(cell, at, point);
        if (!place.open) continue;
        place.weight = std::max(covered_weight, static_cast<double>(at.seen));
        const std::uint64_t stream =
            seed_of(seed, static_cast<std::uint64_t>(first + station), places[station].size());
        std::array<double, 2> mean{};
        const auto add = [&](const SurfacePoint& on, const V3f& weight, int from) {
          V3d fibre = surface_at(cell.scene, on).fibre;
          if (fibre.dot(along) < 0) fibre = -fibre;
          const Arrived arrived = arrived_at(cell.scene, on, fibre, lights, paths, seed_of(stream, 7, from));
          const Eigen::MatrixXd values = project * arrived.irradiance;
          for (int k = 0; k < columns_of_light; ++k)
            place.light[k] += values(k / 3, k % 3) * static_cast<double>(weight[k % 3]) / pi;
          for (int i = 0; i < 3; ++i)
            mean[from] += arrived.irradiance.col(i).mean() * static_cast<double>(weight[i]);
          if (from > 0 || gloss.lustre == 0) return;
          for (int n = 0; n < light_moments; ++n) place.light[2 * columns_of_light + n] = arrived.moments[n];
        };
        add(point, reflected, 0);
        // No ray met its other side: without the noise of its fibres.
        const SurfacePoint inside = other_side(point);
        if (cell.scene.is_translucent()) {
          const YarnBrdf wall = surface_at(cell.scene, inside);
          add(inside, V3f(wall.albedo * (wall.brightness * wall.transmission * dull_weight(wall))), 1);
        }
        place.light.tail(light_moments) *= mean[0] > 0 ? mean[0] / (mean[0] + mean[1]) : 0;
      }
    });
    std::vector<LitPlace> all;
    for (const auto& of_station : places) all.insert(all.end(), of_station.begin(), of_station.end());
    fit_stations(all, c, first, cell.scene.is_translucent(), data);
    first += curve.stations;
  }
}

void compare(const char* what, const YarnData& light, const YarnData& truth, const Yarns& yarns) {
  struct Sums {
    double error = 0, signal = 0, light = 0, truth = 0;
    void add(double w, double a, double b) {
      error += w * (a - b) * (a - b);
      signal += w * b * b;
      light += w * a;
      truth += w * b;
    }
  } all, moments;
  for (int c = 0; c < static_cast<int>(light.curves.size()); ++c) {
    for (int s = 0; s < light.curves[c].stations; ++s) {
      const std::size_t at = std::size_t{light_values_per_station} * (yarns.inside().first_station[c] + s);
      for (const StationPoint& place : points_about(yarns, c, s, 16)) {
        std::array<LightTransfer, 2> transfer{};
        std::array<std::array<double, light_moments>, 2> u{};
        for (int side = 0; side < 2; ++side) {
          const float* values = &(side == 0 ? light : truth).light[at];
          for (int i = 0; i < angle_functions; ++i) {
            for (float& value : transfer[side]) value += place.functions[i] * *values++;
          }
          for (int n = 0; n < light_moments; ++n) {
            for (int i = 0; i < angle_functions; ++i)
              u[side][n] += static_cast<double>(place.functions[i] * *values++);
          }
        }
        const auto weight = static_cast<double>(place.seen);
        for (const V3f& l : spiral_lights(1)) {
          const V3f a = indirect_light(transfer[0], l);
          const V3f b = indirect_light(transfer[1], l);
          for (int k = 0; k < 3; ++k) all.add(weight, static_cast<double>(a[k]), static_cast<double>(b[k]));
        }
        for (int n = 0; n < light_moments; ++n) moments.add(weight, u[0][n], u[1][n]);
      }
    }
  }
  fmt::print("{}: rel. L2 {:.3f}, mean {:.3f}, moments {:.2f}\n", what, std::sqrt(all.error / all.signal),
             all.light / all.truth, std::sqrt(moments.error / std::max(moments.signal, 1e-30)));
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::string stitch = argc > 1 ? argv[1] : "plain-knit";
    const int paths = argc > 2 ? std::atoi(argv[2]) : 128;
    const std::uint64_t seed = argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1;
    const Cell found = value_or_throw(find_cell(stitch));
    const TracedCell cell = value_or_throw(trace_cell(found.mesh, stitch, {}));
    YarnCell yarn = yarn_cell_of(found.mesh);
    YarnData lines = yarn.yarns;
    const std::clock_t begin = std::clock();
    light_yarn(lines, V2f(yarn.period), yarn.through);
    fmt::print("{}: lines {:.2f} CPU s\n", stitch,
               static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
    const Yarns yarns(lines, V2f(yarn.period));
    std::array<YarnData, 2> truths{lines, lines};
    for (std::uint64_t i = 0; i < 2; ++i) trace_yarn_light(cell, paths, 2 * seed + i, truths[i]);
    compare("lines", lines, truths[0], yarns);
    compare("the other truth (noise x sqrt 2)", truths[1], truths[0], yarns);
  } catch (const Failure& failure) {
    fmt::print(stderr, "{}\n", to_line(failure.error));
    return 1;
  }
}
