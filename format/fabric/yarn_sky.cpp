#include "format/fabric/yarn_sky.h"

#include <algorithm>
#include <cmath>

#include "format/base/parallel.h"
#include "format/fabric/directions.h"
#include "format/fabric/lifted.h"

namespace selvedge {
namespace {

/// Points around a station, and lights from each: the functions of both are smooth.
constexpr int angles = 12;
constexpr int angles_of_ply = 6;
constexpr DirectionGrid sky{8, 12};
constexpr float sky_part = 2 * std::numbers::pi_v<float> / static_cast<float>(sky.columns * sky.rows);

using SkyFactors = std::array<float, smooth_functions>;

/// Integrals over the upper hemisphere of z B_j B_k: from functions of smooth light to functions of
/// smooth light.
std::array<SkyFactors, smooth_functions> upper_products() {
  constexpr DirectionGrid grid{64, 64};
  std::array<SkyFactors, smooth_functions> products{};
  for (const V3f& d : directions_of(grid)) {
    const auto basis = smooth_basis(d.x, d.y, d.z);
    const float part = d.z * 2 * std::numbers::pi_v<float> / static_cast<float>(grid.count());
    for (int j = 0; j < smooth_functions; ++j) {
      for (int k = 0; k < smooth_functions; ++k) products[j][k] += part * basis[j] * basis[k];
    }
  }
  return products;
}

/// Share of light from all around that gloss reflects, without its weight: the mean over views.
float mean_gloss(float roughness) {
  const std::vector<V3f> directions = directions_of({16, 16});
  const float part = 2 * std::numbers::pi_v<float> / static_cast<float>(directions.size());
  float sum = 0;
  for (const V3f& v : directions) {
    for (const V3f& l : directions) sum += gloss_reflectance(l, v, roughness) * l.z * v.z;
  }
  return std::min(1.0F, sum * part * part * std::numbers::inv_pi_v<float>);
}

/// Integrals over the lights that reach the point of the cosine, times the functions.
SkyFactors seen_sky(const Yarns& yarns, const V3f& point, const V3f& normal, std::span<const V3f> lights) {
  SkyFactors factors{};
  for (const V3f& l : lights) {
    const float cosine = normal.dot(lifted(l));
    if (!(cosine > 0) || yarns.occluded(point, l)) continue;
    const float part = sky_part * cosine * std::min(1.0F, l.z / min_rise);
    const auto basis = smooth_basis(l.x, l.y, l.z);
    for (int k = 0; k < smooth_functions; ++k) factors[k] += part * basis[k];
  }
  return factors;
}

/// Ratio of the mean indirect light over the surface of plies to the light with the factor of the sky.
V3f groove_of_sky(const YarnCurve& curve) {
  constexpr float mean_outward = 0.6F;
  if (curve.plies.count == 1 || curve.plies.sides != 0) return V3f(1);
  return (V3f(1) + curve.plies.groove * mean_outward) / (1 + sky_groove * mean_outward);
}

/// A point of the surface about a station, and its functions of the angle.
struct SkyPoint {
  V3f above, normal;
  std::array<float, angle_functions> functions;
};

/// Evenly around the yarn, or around its plies where these have sides: up to where they touch.
std::vector<SkyPoint> points_about(const Yarns& yarns, int curve, int station) {
  const YarnPlies& plies = yarns.data().curves[curve].plies;
  std::vector<SkyPoint> points;
  const auto add = [&](const YarnFrame& frame, const V3f& from, float angle) {
    const V3f round = from * std::cos(angle) + frame.tangent.cross(from) * std::sin(angle);
    const V3f beside = frame.tangent.cross(frame.across);
    YarnPoint at;
    at.cosine = round.dot(frame.across);
    at.sine = round.dot(beside);
    at.side = {frame.out.dot(frame.across), frame.out.dot(beside)};
    const V3f normal = frame.normal_of(round);
    points.push_back(
        {frame.place_of(round) + normal * (frame.radius * leave_radii), normal, angle_factors(plies, at)});
  };
  constexpr float pi = std::numbers::pi_v<float>;
  if (plies.sides == 0) {
    const YarnFrame frame = yarns.frame_at(curve, station);
    for (int a = 0; a < angles; ++a) add(frame, frame.across, 2 * pi * static_cast<float>(a) / angles);
    return points;
  }
  const float reach = pi / 2 + pi / static_cast<float>(plies.count);
  for (int ply = 0; ply < plies.count; ++ply) {
    const YarnFrame frame = yarns.frame_at(curve, station, ply);
    for (int a = 0; a < angles_of_ply; ++a)
      add(frame, frame.out, reach * (2 * (static_cast<float>(a) + 0.5F) / angles_of_ply - 1));
  }
  return points;
}

/// Coefficients of the functions of the angle, of all functions of light, that fit values at points best.
class SkyFit {
 public:
  void add(const SkyPoint& point, const SkyFactors& values) {
    for (int i = 0; i < angle_functions; ++i) {
      for (int j = 0; j < angle_functions; ++j) rows_[i][j] += point.functions[i] * point.functions[j];
      for (int k = 0; k < smooth_functions; ++k)
        rows_[i][angle_functions + k] += point.functions[i] * values[k];
    }
  }
  /// Two plies do not tell all sides: a little of each is taken off.
  std::array<SkyFactors, angle_functions> solved() {
    std::array<SkyFactors, angle_functions> result{};
    for (int i = 0; i < angle_functions; ++i) rows_[i][i] += 1e-4F * rows_[0][0] + 1e-6F;
    for (int i = 0; i < angle_functions; ++i) {
      for (int j = 0; j < angle_functions; ++j) {
        if (j == i) continue;
        const float share = rows_[j][i] / rows_[i][i];
        for (std::size_t k = 0; k < rows_[j].size(); ++k) rows_[j][k] -= share * rows_[i][k];
      }
    }
    for (int i = 0; i < angle_functions; ++i) {
      for (int k = 0; k < smooth_functions; ++k) result[i][k] = rows_[i][angle_functions + k] / rows_[i][i];
    }
    return result;
  }

 private:
  std::array<std::array<float, angle_functions + smooth_functions>, angle_functions> rows_{};
};

}  // namespace

std::vector<float> sky_of(const Yarns& yarns) {
  const YarnData& data = yarns.data();
  const std::array<SkyFactors, smooth_functions> upper = upper_products();
  std::vector<float> result(data.light.size());
  const std::vector<V3f> lights = directions_of(sky);
  std::size_t station = 0;
  for (int c = 0; c < static_cast<int>(data.curves.size()); ++c) {
    const YarnCurve& curve = data.curves[c];
    const float weight = curve.gloss.weight;
    const float outermost = curve.plies.count > 1 && curve.plies.sides == 0 ? 1 + sky_groove : 1;
    const V3f reflectance =
        (curve.albedo * (1 - weight) + V3f(weight > 0 ? weight * mean_gloss(curve.gloss.roughness) : 0)) *
        std::numbers::inv_pi_v<float>;
    parallel_for(0, curve.stations, [&](int number) {
      const V3f groove = groove_of_sky(curve);
      const std::size_t first = (station + number) * light_values_per_station;
      float* to = &result[first];
      const float* indirect = &data.light[first];
      const float* through = data.through.empty() ? nullptr : &data.through[first];
      for (int i = 0; i < angle_functions; ++i) {
        for (int k = 0; k < smooth_functions; ++k) {
          for (int colour = 0; colour < 3; ++colour) {
            float& sum = to[(i * smooth_functions + k) * 3 + colour];
            for (int j = 0; j < smooth_functions; ++j)
              sum += indirect[(i * smooth_functions + j) * 3 + colour] * upper[j][k];
            for (int j = 0; through != nullptr && j < smooth_functions; ++j)
              sum +=
                  through[(i * smooth_functions + j) * 3 + colour] * upper[j][k] * (is_odd_in_z(k) ? -1 : 1);
            sum *= groove[colour];
          }
        }
      }
      SkyFit fit;
      for (const SkyPoint& point : points_about(yarns, c, number))
        fit.add(point, seen_sky(yarns, point.above, point.normal, lights));
      const auto direct = fit.solved();
      for (int i = 0; i < angle_functions; ++i) {
        for (int k = 0; k < smooth_functions; ++k) {
          for (int colour = 0; colour < 3; ++colour)
            to[(i * smooth_functions + k) * 3 + colour] += direct[i][k] * reflectance[colour] / outermost;
        }
      }
    });
    station += curve.stations;
  }
  return result;
}

}  // namespace selvedge
