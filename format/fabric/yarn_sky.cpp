#include "format/fabric/yarn_sky.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include "format/base/parallel.h"
#include "format/base/random.h"
#include "format/fabric/directions.h"
#include "format/fabric/lifted.h"

namespace selvedge {
namespace {

/// Points around a station, and lights from each: the functions of both are smooth.
constexpr int angles = 12;
constexpr int angles_of_ply = 6;
constexpr DirectionGrid traced_sky{8, 12}, cast_sky{6, 8};
/// Stations take lights in turn: light varies little from one to the next.
constexpr int lights_of_station = 24;
constexpr float light_part = 2 * std::numbers::pi_v<float> / lights_of_station;

using SkyFactors = std::array<float, smooth_function_count>;

/// Integrals over the upper hemisphere of z B_j B_k: from functions of smooth light to functions of
/// smooth light.
std::array<SkyFactors, smooth_function_count> upper_products() {
  constexpr DirectionGrid grid{64, 64};
  std::array<SkyFactors, smooth_function_count> products{};
  for (const V3f& d : cell_directions(grid)) {
    const auto basis = smooth_basis(d.x, d.y, d.z);
    const float part = d.z * 2 * std::numbers::pi_v<float> / static_cast<float>(grid.count());
    for (int j = 0; j < smooth_function_count; ++j)
      for (int k = 0; k < smooth_function_count; ++k) products[j][k] += part * basis[j] * basis[k];
  }
  return products;
}

/// Coefficients of the functions of the angle, of all functions of light, that fit values at points best.
class SkyFit {
 public:
  void add(const StationPoint& point, const SkyFactors& values) {
    for (int i = 0; i < angle_function_count; ++i) {
      for (int j = 0; j < angle_function_count; ++j) rows_[i][j] += point.functions[i] * point.functions[j];
      for (int k = 0; k < smooth_function_count; ++k)
        rows_[i][angle_function_count + k] += point.functions[i] * values[k];
    }
  }
  /// Two plies do not represent all sides: a little of each is taken off.
  std::array<SkyFactors, angle_function_count> solved() {
    std::array<SkyFactors, angle_function_count> result{};
    for (int i = 0; i < angle_function_count; ++i) rows_[i][i] += 1e-4F * rows_[0][0] + 1e-6F;
    for (int i = 0; i < angle_function_count; ++i) {
      for (int j = 0; j < angle_function_count; ++j) {
        if (j == i) continue;
        const float fraction = rows_[j][i] / rows_[i][i];
        for (std::size_t k = 0; k < rows_[j].size(); ++k) rows_[j][k] -= fraction * rows_[i][k];
      }
    }
    for (int i = 0; i < angle_function_count; ++i)
      for (int k = 0; k < smooth_function_count; ++k)
        result[i][k] = rows_[i][angle_function_count + k] / rows_[i][i];
    return result;
  }

 private:
  std::array<std::array<float, angle_function_count + smooth_function_count>, angle_function_count> rows_{};
};

/// Direct light by station; it depends on no colour.
using DirectSky = std::vector<std::array<SkyFactors, angle_function_count>>;

/// A point of a station, and the integrals over the lights that reach it of the cosine, times the functions.
struct SkyPoint {
  StationPoint point;
  SkyFactors seen{};
};

DirectSky direct_sky(const Yarns& yarns, const LightCaster& cast, const DirectionGrid& sky) {
  constexpr int lights_together = 8;
  std::vector<std::vector<SkyPoint>> stations;
  for (int c = 0; c < static_cast<int>(yarns.data().curves.size()); ++c) {
    const YarnCurve& curve = yarns.data().curves[c];
    const std::size_t first = stations.size();
    stations.resize(first + curve.stations);
    parallel_for(0, curve.stations, [&](int number) {
      for (const StationPoint& point :
           points_around_station(yarns, c, number, curve.plies.count > 1 ? angles_of_ply : angles))
        stations[first + number].push_back({point});
    });
  }
  const std::vector<V3f> lights = cell_directions(sky);
  const int parts = sky.count() / lights_of_station;
  std::array<LightAtPoint, lights_together> reached;
  for (int begin = 0; begin < sky.count(); begin += lights_together) {
    const int count = std::min(lights_together, sky.count() - begin);
    parallel_for(0, count, [&](int i) { reached[i] = cast(lights[begin + i]); });
    parallel_for(0, static_cast<int>(stations.size()), [&](int station) {
      for (int i = 0; i < count; ++i) {
        const int number = begin + i;
        if ((number + number / sky.columns) % parts != station % parts) continue;
        const V3f& l = lights[number];
        const auto basis = smooth_basis(l.x, l.y, l.z);
        for (auto& [point, seen] : stations[station]) {
          const float cosine = point.normal.dot(clamp_rise(l));
          if (!(cosine > 0)) continue;
          const float part = light_part * cosine * std::min(1.0F, l.z / min_ray_rise) * reached[i](point);
          for (int k = 0; k < smooth_function_count; ++k) seen[k] += part * basis[k];
        }
      }
    });
  }
  DirectSky direct;
  for (const auto& points : stations) {
    SkyFit fit;
    for (const auto& [point, seen] : points) fit.add(point, seen);
    direct.push_back(fit.solved());
  }
  return direct;
}

/// The same of yarn that lies as one of the last did: designers show it in colour after colour.
std::shared_ptr<const DirectSky> known_sky(const Yarns& yarns, const LightCaster& cast,
                                           const DirectionGrid& sky) {
  constexpr std::size_t max_known = 4;
  static std::mutex mutex;
  struct Known {
    std::uint64_t segments;  ///< their hash
    V2f period;
    std::shared_ptr<const DirectSky> direct;
  };
  static std::deque<Known> known;
  const auto& inside = yarns.geometry().segments;
  const std::string_view bytes(reinterpret_cast<const char*>(inside.data()), inside.size_bytes());
  std::uint64_t segments = bytes.size();
  for (std::size_t i = 0; i < bytes.size(); i += sizeof(std::uint32_t)) {
    std::uint32_t word = 0;
    std::memcpy(&word, &bytes[i], sizeof word);
    segments = hash64(segments ^ word);
  }
  {
    const std::scoped_lock lock(mutex);
    const auto found = std::ranges::find_if(
        known, [&](const Known& one) { return one.period == yarns.period() && one.segments == segments; });
    if (found != known.end()) return found->direct;
  }
  auto direct = std::make_shared<const DirectSky>(direct_sky(yarns, cast, sky));
  const std::scoped_lock lock(mutex);
  if (known.size() == max_known) known.pop_front();
  return known.emplace_back(Known{segments, yarns.period(), std::move(direct)}).direct;
}

}  // namespace

std::vector<float> sky_transfer(const Yarns& yarns, const LightCaster& cast) {
  const YarnData& data = yarns.data();
  const LightCaster traced = [&](const V3f& light) -> LightAtPoint {
    return [&yarns, light](const StationPoint& point) {
      const V3f above = point.position + point.normal * (point.radius * surface_offset_radii);
      return yarns.is_occluded(above, light) ? 0.0F : 1.0F;
    };
  };
  const auto sky_seen = known_sky(yarns, cast ? cast : traced, cast ? cast_sky : traced_sky);
  const std::array<SkyFactors, smooth_function_count> upper = upper_products();
  std::vector<float> result(data.station_light.size());
  std::size_t station = 0;
  for (const YarnCurve& curve : data.curves) {
    const float weight = curve.gloss.weight;
    const V3f reflectance = (curve.albedo * (1 - weight) +
                             V3f(weight > 0 ? weight * mean_gloss_albedo(curve.gloss.roughness) : 0)) *
                            std::numbers::inv_pi_v<float>;
    parallel_for(0, curve.stations, [&](int number) {
      // The mean over the surface of plies of the factor that files of earlier writers have.
      const V3f groove = V3f(1) + curve.plies.outward_gain * (curve.plies.count > 1 ? 0.6F : 0);
      const std::size_t first = (station + number) * light_values_per_station;
      float* to = &result[first];
      const float* indirect = &data.station_light[first];
      const float* through = data.light_through.empty() ? nullptr : &data.light_through[first];
      for (int i = 0; i < angle_function_count; ++i) {
        for (int k = 0; k < smooth_function_count; ++k) {
          for (int colour = 0; colour < 3; ++colour) {
            float& sum = to[(i * smooth_function_count + k) * 3 + colour];
            for (int j = 0; j < smooth_function_count; ++j)
              sum += indirect[(i * smooth_function_count + j) * 3 + colour] * upper[j][k];
            for (int j = 0; through != nullptr && j < smooth_function_count; ++j)
              sum += through[(i * smooth_function_count + j) * 3 + colour] * upper[j][k] *
                     (is_odd_in_z(k) ? -1 : 1);
            sum *= groove[colour];
          }
        }
      }
      const auto& direct = (*sky_seen)[station + number];
      for (int i = 0; i < angle_function_count; ++i)
        for (int k = 0; k < smooth_function_count; ++k)
          for (int colour = 0; colour < 3; ++colour)
            to[(i * smooth_function_count + k) * 3 + colour] += direct[i][k] * reflectance[colour];
    });
    station += curve.stations;
  }
  return result;
}

}  // namespace selvedge
