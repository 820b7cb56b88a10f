#include "converter/light/light_bands.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace selvedge {
namespace {

struct Bands {
  int count = 1;
  float margin = 0;  ///< above and below a band, mm
};

Bands bands_of(const YarnData& data, const V2f& period, int max_ply_stations) {
  constexpr float margin_radii = 12;
  constexpr double max_part = 0.8;  ///< of the cloth in a band with its margins
  double ply_stations = 0;
  Bands bands;
  for (const YarnCurve& curve : data.curves) {
    if (curve.repeat_offset.y != 0) return {};
    ply_stations += 1.0 * curve.stations * curve.plies.count;
    bands.margin = std::max(bands.margin, margin_radii * curve.radius);
  }
  const auto all = static_cast<double>(period.y);
  const double margins = 2 * static_cast<double>(bands.margin);
  const double height = std::max(all * max_ply_stations / ply_stations - margins, margins);
  bands.count = static_cast<int>(std::ceil(all / height));
  const bool saves = all / bands.count + margins < max_part * all;
  return ply_stations > max_ply_stations && saves ? bands : Bands();
}

/// A band with its margins, as a cloth that repeats.
struct Band {
  YarnData yarn;
  std::vector<V3f> through;
  struct Stations {
    std::size_t in_band, in_all, count;
  };
  std::vector<Stations> inner;  ///< of curves that belong to the band and to no margin
};

/// The curves whose mean heights lie in [low, low + height), or in a repeat of it.
Band band_of(const YarnData& data, const V2f& period, std::span<const V3f> through, float low, float height,
             float margin) {
  Band band;
  std::size_t station = 0;
  std::size_t in_band = 0;
  for_each_curve(data, [&](std::size_t c, const YarnCurve& curve, std::span<const V3f> nodes) {
    double sum = 0;
    for (const V3f& node : nodes) sum += static_cast<double>(node.y);
    const float above = static_cast<float>(sum / static_cast<double>(nodes.size())) - low + margin;
    const float moved = -std::floor(above / period.y) * period.y;
    const auto count = static_cast<std::size_t>(curve.stations);
    if (above + moved < height + 2 * margin) {
      band.yarn.curves.push_back(curve);
      band.through.push_back(through[c]);
      for (const V3f& node : nodes) band.yarn.nodes.push_back(node + V3f(0, moved, 0));
      if (above + moved >= margin && above + moved < margin + height)
        band.inner.push_back({in_band, station, count});
      in_band += count;
    }
    station += count;
  });
  return band;
}

}  // namespace

bool compute_light_in_bands(YarnData& data, const V2f& period, std::span<const V3f> through,
                            const LineLightOptions& options, int max_ply_stations) {
  const Bands bands = bands_of(data, period, max_ply_stations);
  if (bands.count == 1) return compute_yarn_light(data, period, through, options);
  const std::size_t values = std::size_t{light_values_per_station} * counts_of(data).stations;
  data.station_light.assign(values, 0);
  data.light_through.assign(options.both_sides ? values : 0, 0);
  const float height = period.y / static_cast<float>(bands.count);
  bool settled = true;
  for (int b = 0; b < bands.count; ++b) {
    Band band = band_of(data, period, through, height * static_cast<float>(b), height, bands.margin);
    if (band.inner.empty()) continue;
    LineLightOptions of_band = options;
    if (options.progress)
      of_band.progress = [&](double fraction) { options.progress((b + fraction) / bands.count); };
    settled &= compute_yarn_light(band.yarn, {period.x, height + 2 * bands.margin}, band.through, of_band);
    for (auto light : {&YarnData::station_light, &YarnData::light_through}) {
      if ((data.*light).empty()) continue;
      for (const auto& [in_band, in_all, count] : band.inner)
        std::copy_n(&(band.yarn.*light)[in_band * light_values_per_station], count * light_values_per_station,
                    &(data.*light)[in_all * light_values_per_station]);
    }
  }
  return settled;
}

}  // namespace selvedge
