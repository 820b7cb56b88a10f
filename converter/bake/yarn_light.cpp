#include "converter/bake/yarn_light.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "converter/light/path_tracer.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

using std::numbers::pi;

constexpr int angles = 16;
constexpr std::uint64_t stream_inside = mix(202);
constexpr int light_count = 64;
/// Weight of a place that other yarn covers, where nothing is known: keeps the sums solvable.
constexpr double covered_weight = 1e-3;
/// What holds the functions of the double angle against noise.
constexpr double smoothing = 1e-3;

/// Evenly over the upper half of the sphere by its area: a spiral of golden angles.
std::vector<V3f> spiral_lights() {
  std::vector<V3f> lights;
  for (int i = 0; i < light_count; ++i) {
    const double z = (i + 0.5) / light_count;
    const double r = std::sqrt(1 - z * z);
    const double turn = i * pi * (3 - std::sqrt(5.0));
    lights.emplace_back(V3d(r * std::cos(turn), r * std::sin(turn), z));
  }
  return lights;
}

/// Irradiance, [light](colour), of a point of the surface by way of others; from lights below, directly as
/// well.
Eigen::MatrixX3d irradiance_at(const TracedCell& cell, const SurfacePoint& point, std::span<const V3f> lights,
                               const YarnLightOptions& options, std::uint64_t place) {
  const RayScene& scene = cell.scene;
  const PathTracer tracer(scene, options.bounces);
  std::uint64_t rays = 0;
  std::vector<V3d> sum(lights.size(), V3d(0, 0, 0));
  for (std::size_t l = 0; l < lights.size(); ++l) {
    const double cosine = lights[l].z < 0 ? static_cast<double>(point.face_normal.dot(lights[l])) : 0;
    if (cosine > 0 && !scene.occluded(point, lights[l])) sum[l] = V3d(cosine * options.paths / pi);
  }
  for (int path = 0; path < options.paths; ++path) {
    PathSampler sampler(static_cast<std::uint32_t>(path), place);
    const V3d direction = cosine_direction(V3d(point.face_normal), sampler.next());
    SurfacePoint at;
    if (!scene.trace(scene.leave(point), direction, at)) continue;
    const YarnSurface surface = surface_at(scene, at);
    for (std::size_t l = 0; l < lights.size(); ++l) {
      sum[l] += direct_light(scene, at, surface, lights[l], -direction, rays);
    }
    tracer.add_indirect(at, -direction, lights, sampler, sum);
  }
  Eigen::MatrixX3d result(lights.size(), 3);
  for (std::size_t l = 0; l < lights.size(); ++l) {
    for (int c = 0; c < 3; ++c) result(static_cast<int>(l), c) = sum[l][c] * pi / options.paths;
  }
  return result;
}

}  // namespace

void trace_yarn_light(const TracedCell& cell, const YarnLightOptions& options, YarnData& data) {
  std::vector<V3f> lights = spiral_lights();
  Eigen::MatrixXd by_light(light_count, light_functions_of_yarn);
  for (int l = 0; l < light_count; ++l) {
    const auto basis = light_basis(lights[l]);
    for (int k = 0; k < light_functions_of_yarn; ++k) by_light(l, k) = static_cast<double>(basis[k]);
  }
  const Eigen::MatrixXd project = (by_light.transpose() * by_light).ldlt().solve(by_light.transpose());

  const int sides = options.both_sides ? 2 : 1;
  for (int l = 0; options.both_sides && l < light_count; ++l) lights.push_back(mirrored(lights[l]));

  std::size_t stations = 0;
  for (const YarnCurve& curve : data.curves) stations += curve.stations;
  data.light.assign(stations * light_values_per_station, 0);
  data.through.assign(options.both_sides ? data.light.size() : 0, 0);
  const V2d period = cell.scene.period() * cell.mm;
  const Yarns yarns(data, V2f(period));
  std::size_t first = 0;
  for (std::size_t c = 0; c < data.curves.size(); ++c) {
    const YarnCurve& curve = data.curves[c];
    const auto radius = static_cast<double>(curve.radius);
    const V3f reflected =
        curve.albedo * (1 - curve.gloss.weight) +
        V3f(curve.gloss.weight * static_cast<float>(mean_gloss_albedo(curve.gloss.roughness)));
    std::vector<Eigen::MatrixXd> solved(curve.stations);
    parallel_for(0, curve.stations, [&](int station) {
      Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(angle_functions, angle_functions);
      constexpr int columns = 3 * light_functions_of_yarn;
      Eigen::MatrixXd right = Eigen::MatrixXd::Zero(angle_functions, sides * columns);
      for (int i = 1; i < angle_functions; ++i) normal(i, i) = smoothing * (i < 3 ? 1 : 4);
      const YarnFrame frame = yarns.frame_at(static_cast<int>(c), station);
      for (int a = 0; a < angles; ++a) {
        const double angle = 2 * pi * a / angles;
        const V3d out =
            V3d(frame.across) * std::cos(angle) + V3d(frame.tangent.cross(frame.across)) * std::sin(angle);
        const auto basis =
            angle_basis(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)));
        Eigen::Matrix<double, angle_functions, 1> row;
        for (int i = 0; i < angle_functions; ++i) row[i] = static_cast<double>(basis[i]);
        SurfacePoint point;
        // From a little above the surface: what is met too early is other yarn.
        const V3d above = V3d(frame.position) + out * (1.15 * radius);
        bool open = cell.scene.trace(above / cell.mm, -out, point) && !point.back;
        if (open) {
          V3d off = V3d(point.position) * cell.mm - above;
          for (int k = 0; k < 2; ++k) off[k] -= std::round(off[k] / period[k]) * period[k];
          open = std::abs(off.length() - 0.15 * radius) < 0.1 * radius;
        }
        normal += (open ? 1 : covered_weight) * row * row.transpose();
        if (!open) continue;
        const std::uint64_t place = seed_of(options.seed, 201, (first + station) * angles + a);
        const auto add = [&](const SurfacePoint& on, const V3f& share, std::uint64_t stream) {
          const Eigen::MatrixX3d irradiance = irradiance_at(cell, on, lights, options, place ^ stream);
          for (int side = 0; side < sides; ++side) {
            const Eigen::MatrixXd values = project * irradiance.middleRows(side * light_count, light_count);
            for (int k = 0; k < columns; ++k) {
              const double part = static_cast<double>(share[k % 3]) / pi;
              right.col(side * columns + k) += row * (values(k / 3, k % 3) * part);
            }
          }
        };
        add(point, reflected, 0);
        if (cell.scene.is_translucent()) {
          const SurfacePoint inside = other_side(point);  // no ray met it: without the noise of its fibres
          add(inside, diffuse_shares(cell.scene, inside).through, stream_inside);
        }
      }
      solved[station] = normal.ldlt().solve(right);
    });
    for (int side = 0; side < sides; ++side) {
      constexpr int columns = 3 * light_functions_of_yarn;
      std::array<double, 3> largest{};
      for (const auto& values : solved) {
        for (int k = 0; k < columns; ++k) {
          largest[k % 3] = std::max(largest[k % 3], values.col(side * columns + k).cwiseAbs().maxCoeff());
        }
      }
      const double brightest = *std::max_element(largest.begin(), largest.end());
      // Of all colours 8 bits, and of light that comes through at least 6 of each: a red that is a hundred
      // times as bright as the blue would leave it nothing.
      std::array<double, 3> step{1, 1, 1};
      for (int colour = 0; colour < 3; ++colour) {
        const bool fine = largest[colour] > 0 && (side == 1 || cell.scene.is_translucent());
        const double own = fine ? largest[colour] / 31 : brightest;
        const double wanted = std::min(brightest / 127, own);
        if (wanted > 0) step[colour] = std::exp2(std::ceil(std::log2(wanted)));
      }
      float* out = &(side == 0 ? data.light : data.through)[first * light_values_per_station];
      for (const auto& values : solved) {
        for (int i = 0; i < angle_functions; ++i) {
          for (int k = 0; k < columns; ++k) {
            *out++ =
                static_cast<float>(std::round(values(i, side * columns + k) / step[k % 3]) * step[k % 3]);
          }
        }
      }
    }
    first += curve.stations;
  }
}

}  // namespace selvedge
