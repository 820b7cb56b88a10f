#include "converter/light/recoloured_light.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "converter/light/line_light.h"
#include "converter/light/yarn_brdf.h"
#include "converter/light/yarn_lines.h"

namespace selvedge {
namespace {

constexpr int direction_count = 8;
constexpr float spacing_radii = 1;
/// Nodes of which one is kept, and sweeps of light that is passed on.
constexpr int nodes_of_one = 4;
constexpr int sweeps = 32;
constexpr float max_growth = 2;
constexpr float penalty_of_growth = 2;  ///< in the choice of the nearest colour
constexpr float min_light = 1e-9F;

/// Three colours before, and after.
using Values = std::array<float, 8>;

/// Fractions of the light that falls on a yarn: all that it sends on, and what passes its walls.
struct Scattering {
  Values all{}, through{};
  void set(int first, const YarnCurve& curve, const V3f& albedo, float passing) {
    const float w = curve.gloss.weight;
    const float gloss = w > 0 ? w * mean_gloss_albedo(curve.gloss.roughness) : 0;
    const float dull = passing > 0 ? 1 - gloss : 1 - w;
    for (int c = 0; c < 3; ++c) {
      const float wall = albedo[c] * passing * dull;
      const float inside = albedo[c] * (1 + passing * (1 - dull));
      through[first + c] = wall * wall / (1 - inside);
      all[first + c] = albedo[c] * dull + gloss + through[first + c];
    }
  }
};

/// Yarns without plies and hairs, of fewer nodes.
YarnData whole_yarns(const YarnData& data) {
  YarnData whole;
  for_each_curve(data, [&](std::size_t, const YarnCurve& curve, std::span<const V3f> nodes) {
    const int step = std::clamp(curve.nodes / 3, 1, nodes_of_one);
    YarnCurve& to = whole.curves.emplace_back();
    to.repeat_offset = curve.repeat_offset;
    to.radius = curve.radius;
    to.flattening = curve.flattening;
    to.nodes = curve.nodes / step;
    to.stations = curve.stations;
    for (int i = 0; i < to.nodes; ++i) {
      whole.nodes.push_back(nodes[i * step]);
      if (!curve.squeezes.empty()) to.squeezes.push_back(curve.squeezes[i * step]);
    }
  });
  return whole;
}

/// Light of the sky that stations send to each other.
class SkyExchange {
 public:
  SkyExchange(const Yarns& yarns, std::vector<Scattering> scattering)
      : patches_(yarns, 1, 2), scattering_(std::move(scattering)) {
    const auto& curves = yarns.data().curves;
    for (std::size_t c = 0; c < curves.size(); ++c) curve_.resize(curve_.size() + curves[c].stations, c);
    area_.assign(curve_.size(), 1e-30F);
    for (auto& sky : sky_) sky.assign(curve_.size(), 0);
    float thinnest = std::numeric_limits<float>::max();
    for (const YarnCurve& curve : curves) thinnest = std::min(thinnest, curve.radius);
    std::vector<std::int32_t> pieces(yarns.geometry().segments.size());
    std::iota(pieces.begin(), pieces.end(), 0);
    LineScratch scratch;
    for (int i = 0; i < direction_count; ++i) {
      const LineCrossings met = trace_lines(yarns, patches_, pieces, spiral_direction(i, direction_count),
                                            spacing_radii * thinnest, i, scratch);
      for (const auto& [upper, lower] : met.open_air_links) {
        links_.push_back({station_of(upper), station_of(lower), met.area});
        for (const PatchFace& face : {upper, lower}) area_[station_of(face)] += met.area;
      }
      for (const bool below : {false, true})
        for (const PatchFace& face : below ? met.sky_below : met.sky_above) {
          sky_[below ? 1 : 0][station_of(face)] += met.area;
          area_[station_of(face)] += met.area;
        }
    }
    for (auto& sky : sky_)
      for (std::size_t s = 0; s < sky.size(); ++s) sky[s] /= area_[s];
  }
  /// Light that each station sends on, without the reflection of the sky above itself.
  std::vector<Values> sent_of_sky(bool below) const {
    const std::vector<float>& sky = sky_[below ? 1 : 0];
    std::vector<Values> light(curve_.size());
    std::vector<Values> sent = light;
    for (int sweep = 0; sweep <= sweeps; ++sweep) {
      for (std::size_t s = 0; s < light.size(); ++s) {
        const auto& [all, through] = scattering_[curve_[s]];
        const auto& of_sky = below || sweep < sweeps ? all : through;
        for (int k = 0; k < 6; ++k) sent[s][k] = all[k] * light[s][k] + of_sky[k] * sky[s];
      }
      if (sweep == sweeps) break;
      light.assign(light.size(), {});
      for (const auto& [a, b, area] : links_)
        for (int k = 0; k < 8; ++k) {
          light[a][k] += area / area_[a] * sent[b][k];
          light[b][k] += area / area_[b] * sent[a][k];
        }
    }
    return sent;
  }

 private:
  static int station_of(const PatchFace& face) { return face.patch / 2; }
  struct Link {
    int a, b;
    float area;
  };
  YarnPatches patches_;
  std::vector<Scattering> scattering_;  ///< of the curves
  std::vector<std::size_t> curve_;      ///< of the stations
  std::vector<float> area_;             ///< of the lines that meet them
  std::array<std::vector<float>, 2> sky_;
  std::vector<Link> links_;
};

/// Scales the light of stations from three colours before to three after. Each takes the light of the colour
/// that was nearest to it, which grows by max_growth at most, and the mean of all light for the rest: light
/// that is dark beside others is rounded coarsely.
void scale_light(const std::vector<Values>& seen, std::vector<float>& light) {
  const std::vector<float> old = light;
  // The mean of all light by what it is about.
  std::array<float, yarn_light_function_count> mean{};
  float all = 1e-30F;
  for (std::size_t i = 0; i < seen.size() * 3; ++i) {
    all += seen[i / 3][i % 3];
    for (int k = 0; k < yarn_light_function_count; ++k)
      mean[k] += old[i / 3 * light_values_per_station + 3 * k + i % 3];
  }
  for (std::size_t s = 0; s < seen.size(); ++s)
    for (int c = 0; c < 3; ++c) {
      const float after = std::max(seen[s][3 + c], min_light);
      const auto away = [&](int other) {
        const float growth = std::log(after / std::max(seen[s][other], min_light));
        return growth > 0 ? penalty_of_growth * growth : -growth;
      };
      const int from =
          std::min({c, (c + 1) % 3, (c + 2) % 3}, [&](int i, int k) { return away(i) < away(k); });
      const float growth = std::min(after / std::max(seen[s][from], min_light), max_growth);
      const float rest = after - growth * seen[s][from];
      float* const to = &light[s * light_values_per_station + c];
      for (int v = 0; v < transfer_values_per_station; v += 3)
        to[v] = growth * old[s * light_values_per_station + v + from];
      for (int k = 0; k < yarn_light_function_count; ++k) to[3 * k] += rest * mean[k] / all;
    }
}

}  // namespace

void recolour_light(YarnData& data, const Yarns& last, std::span<const V3f> through) {
  const Yarns yarns(whole_yarns(data), last.period());
  std::vector<Scattering> scattering(data.curves.size());
  for (std::size_t c = 0; c < scattering.size(); ++c) {
    const YarnCurve& curve = data.curves[c];
    const float albedo = curve.albedo.dot(V3f(1));
    const float passing = albedo > 0 ? through[c].dot(V3f(1)) / albedo : 0;
    scattering[c].set(0, curve, last.data().curves[c].albedo, passing);
    scattering[c].set(3, curve, curve.albedo, passing);
  }
  const SkyExchange exchange(yarns, std::move(scattering));
  for (const bool below : {false, true})
    if (std::vector<float>& of_side = below ? data.light_through : data.station_light; !of_side.empty())
      scale_light(exchange.sent_of_sky(below), of_side);
  data.packing = {};
}

}  // namespace selvedge
