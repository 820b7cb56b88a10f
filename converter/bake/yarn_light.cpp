#include "converter/bake/yarn_light.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "converter/light/path_tracer.h"
#include "format/base/parallel.h"

namespace selvedge {
namespace {

using std::numbers::pi;

/// Places around a station: of a round yarn, and of all its plies.
constexpr int angles = 16;
constexpr int angles_of_plies = 48;
constexpr int columns = 3 * light_functions_of_yarn;
constexpr std::uint64_t stream_inside = mix(202);
constexpr std::uint64_t stream_along = mix(203);
constexpr int light_count = 64;
constexpr double step_of_moments = 1.0 / 32;
/// Weight of a place that other yarn covers: it has the mean of the open ones, lest the functions swing
/// there.
constexpr double covered_weight = 0.05;
/// Light of covered places over the mean of open ones: beside them lie contacts' shadows. By 0.3 dB of near
/// pictures.
constexpr double covered_light = 0.3;
/// How far above a place a ray starts that looks for the surface, in radii.
constexpr double lift = 0.15;
/// Regularises the functions of the double angle against noise.
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

/// Light of the cache under the lights: the result of solve(), or nothing without a cache.
struct CachedLight {
  const IrradianceCache* cache;
  std::vector<float> irradiance;
};

/// Irradiance, [light](colour), of a point of the surface by way of others; from lights below, directly as
/// well.
Eigen::MatrixX3d irradiance_at(const TracedCell& cell, const SurfacePoint& point, std::span<const V3f> lights,
                               const YarnLightOptions& options, const CachedLight& cached,
                               std::uint64_t place) {
  const RayScene& scene = cell.scene;
  Eigen::MatrixX3d result = Eigen::MatrixX3d::Zero(static_cast<int>(lights.size()), 3);
  const PathTracer tracer(scene, options.bounces);
  std::uint64_t rays = 0;
  std::vector<V3d> sum(lights.size(), V3d(0, 0, 0));
  for (std::size_t l = 0; l < lights.size(); ++l) {
    const double cosine = lights[l].z < 0 ? static_cast<double>(point.face_normal.dot(lights[l])) : 0;
    if (cosine > 0 && !scene.occluded(point, lights[l])) result.row(static_cast<int>(l)).fill(cosine);
  }
  if (cached.cache != nullptr) {
    CacheTaps taps;
    if (!cached.cache->taps(point, taps)) return result;
    for (std::size_t k = 0; k < 3; ++k) {
      const float* row = &cached.irradiance[3 * lights.size() * taps.point[k]];
      for (int c = 0; c < 3; ++c) {
        for (int l = 0; l < result.rows(); ++l) result(l, c) += static_cast<double>(taps.weight[k] * *row++);
      }
    }
    return result;
  }
  for (int path = 0; path < options.paths; ++path) {
    PathSampler sampler(static_cast<std::uint32_t>(path), place);
    const V3d direction = cosine_direction(V3d(point.face_normal), sampler.next());
    SurfacePoint at;
    if (!scene.trace(scene.leave(point), direction, at)) continue;
    const YarnBrdf surface = surface_at(scene, at);
    for (std::size_t l = 0; l < lights.size(); ++l) {
      sum[l] += direct_light(scene, at, surface, lights[l], -direction, rays);
    }
    tracer.add_indirect(at, -direction, lights, sampler, sum);
  }
  for (std::size_t l = 0; l < lights.size(); ++l) {
    for (int c = 0; c < 3; ++c) result(static_cast<int>(l), c) += sum[l][c] * pi / options.paths;
  }
  return result;
}

/// A place of the surface about a station, and the light that it reflects.
struct CachePoint {
  V3d above;  ///< mm, in front of it; what a ray from there meets too early is other yarn
  V3d normal;
  double radius;  ///< mm
  Eigen::Matrix<double, 1, angle_functions> row;
  double seen = 1;  ///< roughly the fraction of views that it is seen from
  bool open = false;
  double weight = covered_weight;
  Eigen::RowVectorXd light;  ///< [side][function][colour], then the moments
};

std::vector<CachePoint> places_about(const Yarns& yarns, int curve, int station) {
  const int plies = yarns.data().curves[curve].plies.count;
  std::vector<CachePoint> places;
  for (const StationPoint& point :
       points_about(yarns, curve, station, plies == 1 ? angles : angles_of_plies / plies)) {
    CachePoint& place = places.emplace_back();
    place.normal = V3d(point.normal);
    place.radius = static_cast<double>(point.radius);
    place.above = V3d(point.place) + place.normal * (lift * place.radius);
    place.seen = static_cast<double>(point.seen);
    for (int i = 0; i < angle_functions; ++i) place.row[i] = static_cast<double>(point.functions[i]);
  }
  return places;
}

/// Whether a ray from above the place meets its own surface, past hairs.
bool is_open(const TracedCell& cell, const CachePoint& place, SurfacePoint& point) {
  constexpr double past = 1e-3;  // radii
  V3d from = place.above / cell.mm;
  do {
    if (!cell.scene.trace(from, -place.normal, point)) return false;
    from = V3d(point.position) - place.normal * (past * place.radius / cell.mm);
  } while (point.hair >= 0);
  if (point.back) return false;
  V3d off = V3d(point.position) * cell.mm - place.above;
  const V2d period = cell.scene.period() * cell.mm;
  for (int k = 0; k < 2; ++k) off[k] -= std::round(off[k] / period[k]) * period[k];
  return std::abs(off.length() - lift * place.radius) < 0.1 * place.radius;
}

/// Paths of each of the places about all stations, together; 4 to 128 of each.
constexpr std::size_t paths_of_moments = 1 << 17;

/// Means of U_1 and U_2 (yarns.h) of the light that falls on the point by way of one other yarn: those by
/// which they come nearest to its light under all of `lights`. `fibre`: unit.
std::array<double, light_moments> moments_at(const TracedCell& cell, const SurfacePoint& point,
                                             const V3d& fibre, std::span<const V3f> lights,
                                             std::uint64_t place, int paths) {
  constexpr std::size_t light_step = 4;
  Eigen::MatrixX3d sums = Eigen::MatrixX3d::Zero(static_cast<int>(light_count / light_step), 3);
  std::uint64_t rays = 0;
  for (int path = 0; path < paths; ++path) {
    PathSampler sampler(path, place);
    const V3d direction = cosine_direction(V3d(point.face_normal), sampler.next());
    SurfacePoint met;
    if (!cell.scene.trace(cell.scene.leave(point), direction, met)) continue;
    const YarnBrdf surface = surface_at(cell.scene, met);
    const double x = direction.dot(fibre);
    const Eigen::RowVector3d functions(1, 2 * x, 4 * x * x - 1);
    for (int l = 0; l < sums.rows(); ++l) {
      const V3f& light = lights[static_cast<std::size_t>(l) * light_step];
      const V3d radiance = direct_light(cell.scene, met, surface, light, -direction, rays);
      sums.row(l) += functions * (radiance.x + radiance.y + radiance.z);
    }
  }
  const double all = sums.col(0).squaredNorm();
  std::array<double, light_moments> moments{};
  for (int n = 0; n < light_moments && all > 0; ++n) moments[n] = sums.col(0).dot(sums.col(n + 1)) / all;
  return moments;
}

/// Gives places that other yarn covers a fraction of the mean of the station's open ones, or of the nearest
/// stations' that have any.
void fill_covered(std::vector<std::vector<CachePoint>>& stations) {
  const auto count = static_cast<int>(stations.size());
  std::vector<Eigen::RowVectorXd> means(count);
  for (int s = 0; s < count; ++s) {
    double open = 0;
    for (const CachePoint& place : stations[s]) {
      if (!place.open) continue;
      if (open == 0) means[s].setZero(place.light.size());
      means[s] += place.light * place.weight;
      open += place.weight;
    }
    if (open > 0) means[s] /= open;
  }
  for (int s = 0; s < count; ++s) {
    Eigen::RowVectorXd mean;
    for (int away = 0; away < count && mean.size() == 0; ++away) {
      for (const int other : {(s + away) % count, (s - away + count) % count}) {
        if (means[other].size() == 0) continue;
        mean = mean.size() == 0 ? means[other] : ((mean + means[other]) / 2).eval();
      }
    }
    if (mean.size() == 0) return;
    for (CachePoint& place : stations[s]) {
      if (!place.open) place.light = mean * covered_light;
    }
  }
}

/// The coefficients, [function of the angle][light of a point], that fit the places best.
Eigen::MatrixXd solved_for(const std::vector<CachePoint>& places) {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(angle_functions, angle_functions);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(angle_functions, places.front().light.size());
  for (int i = 1; i < angle_functions; ++i) normal(i, i) = smoothing * (i < 3 ? 1 : 4);
  for (const CachePoint& place : places) {
    normal += place.weight * place.row.transpose() * place.row;
    right += place.weight * place.row.transpose() * place.light;
  }
  return normal.ldlt().solve(right);
}

/// Writes one side's coefficients of each station, rounded to steps that differ by colour.
void write_rounded(const std::vector<Eigen::MatrixXd>& solved, int side, int sides, bool is_translucent,
                   float* out) {
  std::array<double, 3> largest{};
  for (const auto& values : solved) {
    for (int k = 0; k < columns; ++k) {
      largest[k % 3] = std::max(largest[k % 3], values.col(side * columns + k).cwiseAbs().maxCoeff());
    }
  }
  const double brightest = *std::ranges::max_element(largest);
  // The brightest colour has 8 bits, and of light that comes through each has: a red that is a hundred
  // times as bright as the blue would leave it nothing.
  std::array<double, 3> step{1, 1, 1};
  for (int colour = 0; colour < 3; ++colour) {
    const bool fine = largest[colour] > 0 && (side == 1 || is_translucent);
    const double own = fine ? largest[colour] / 127 : brightest;
    const double wanted = std::min(brightest / 127, own);
    if (wanted > 0) step[colour] = std::exp2(std::ceil(std::log2(wanted)));
  }
  for (const auto& values : solved) {
    for (int i = 0; i < angle_functions; ++i) {
      for (int k = 0; k < columns; ++k) {
        *out++ = static_cast<float>(std::round(values(i, side * columns + k) / step[k % 3]) * step[k % 3]);
      }
    }
    for (int n = 0; n < light_moments; ++n) {
      for (int i = 0; i < angle_functions; ++i) {
        const double moment = side == 0 ? values(i, sides * columns + n) : 0;
        *out++ = static_cast<float>(std::round(moment / step_of_moments) * step_of_moments);
      }
    }
  }
}

}  // namespace

void trace_yarn_light(const TracedCell& cell, const YarnLightOptions& options, IrradianceCache* cache,
                      YarnData& data) {
  std::vector<V3f> lights = spiral_lights();
  Eigen::MatrixXd by_light(light_count, light_functions_of_yarn);
  for (int l = 0; l < light_count; ++l) {
    const auto basis = light_basis(lights[l]);
    for (int k = 0; k < light_functions_of_yarn; ++k) by_light(l, k) = static_cast<double>(basis[k]);
  }
  const Eigen::MatrixXd project = (by_light.transpose() * by_light).ldlt().solve(by_light.transpose());

  const int sides = options.both_sides ? 2 : 1;
  for (int l = 0; options.both_sides && l < light_count; ++l) lights.push_back(mirrored(lights[l]));

  CachedLight cached{cache, {}};
  if (cache != nullptr) cached.irradiance = cache->solve(cell.scene, lights, options.bounces);

  std::size_t stations = 0;
  for (const YarnCurve& curve : data.curves) stations += curve.stations;
  data.light.assign(stations * light_values_per_station, 0);
  data.through.assign(options.both_sides ? data.light.size() : 0, 0);
  const Yarns yarns(data, V2f(cell.scene.period() * cell.mm));
  const auto paths = static_cast<int>(std::clamp<std::size_t>(paths_of_moments / stations, 4, 128));
  std::size_t first = 0;
  for (std::size_t c = 0; c < data.curves.size(); ++c) {
    YarnCurve& curve = data.curves[c];
    const V3f reflected = curve.albedo * (1 - curve.gloss.weight) +
                          V3f(curve.gloss.weight * mean_gloss_albedo(curve.gloss.roughness));
    std::vector<std::vector<CachePoint>> places(curve.stations);
    parallel_for(0, curve.stations, [&](int station) {
      places[station] = places_about(yarns, static_cast<int>(c), station);
      for (std::size_t a = 0; a < places[station].size(); ++a) {
        CachePoint& at = places[station][a];
        at.light = Eigen::RowVectorXd::Zero(sides * columns + light_moments);
        SurfacePoint point;
        if (!is_open(cell, at, point)) continue;
        at.open = true;
        at.weight = std::max(covered_weight, at.seen);
        const std::uint64_t place =
            seed_of(options.seed, 201, (first + station) * places[station].size() + a);
        std::array<double, 2> mean{};  // of the light that the surface reflects, and that comes through it
        const auto add = [&](const SurfacePoint& on, const V3f& weight, std::uint64_t stream) {
          const Eigen::MatrixX3d irradiance =
              irradiance_at(cell, on, lights, options, cached, place ^ stream);
          for (int side = 0; side < sides; ++side) {
            const Eigen::MatrixXd values = project * irradiance.middleRows(side * light_count, light_count);
            for (int k = 0; k < columns; ++k)
              at.light[side * columns + k] += values(k / 3, k % 3) * static_cast<double>(weight[k % 3]) / pi;
          }
          mean[stream == 0 ? 0 : 1] =
              irradiance.topRows(light_count)
                  .colwise()
                  .mean()
                  .dot(Eigen::RowVector3d(static_cast<double>(weight.x), static_cast<double>(weight.y),
                                          static_cast<double>(weight.z)));
        };
        add(point, reflected, 0);
        if (cell.scene.is_translucent()) {
          const SurfacePoint inside = other_side(point);  // no ray met it: without the noise of its fibres
          add(inside, diffuse_albedos(cell.scene, inside).through, stream_inside);
        }
        if (curve.gloss.lustre == 0 || !(mean[0] > 0)) continue;
        const V3d fibre = surface_at(cell.scene, point).fibre;
        const V3d along(yarns.frame_at(static_cast<int>(c), station).tangent);
        const auto moments = moments_at(cell, point, fibre.dot(along) < 0 ? -fibre : fibre, lights,
                                        place ^ stream_along, paths);
        for (int n = 0; n < light_moments; ++n)
          at.light[sides * columns + n] = moments[n] * mean[0] / (mean[0] + mean[1]);
      }
    });
    fill_covered(places);
    std::vector<Eigen::MatrixXd> solved(curve.stations);
    parallel_for(0, curve.stations, [&](int station) { solved[station] = solved_for(places[station]); });
    for (int side = 0; side < sides; ++side)
      write_rounded(solved, side, sides, cell.scene.is_translucent(),
                    &(side == 0 ? data.light : data.through)[first * light_values_per_station]);
    first += curve.stations;
  }
}

}  // namespace selvedge
