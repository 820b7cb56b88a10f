// Yarn for the tests.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "format/base/random.h"
#include "format/fabric/fabric.h"

namespace selvedge::test {

/// A yarn along x through a cell of `period` mm.
inline YarnData straight(float period, float radius) {
  YarnData data;
  YarnCurve curve;
  curve.nodes = 4;
  curve.stations = 1;
  curve.repeat_offset = {1, 0};
  curve.radius = radius;
  data.curves = {curve};
  for (int i = 0; i < 4; ++i) data.nodes.emplace_back(period * static_cast<float>(i) / 4, period / 2, radius);
  data.station_light.assign(light_values_per_station, 0);
  return data;
}

/// Chains that wind at random through a cell of `period` mm: yarns, plies that cross, a ring, thick and thin.
inline YarnData tangle(Random& random, const V2f& period, int curves) {
  const auto uniform = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random.uniform());
  };
  const float unit = std::min(period.x, period.y);
  YarnData data;
  int stations = 0;
  for (int c = 0; c < curves; ++c) {
    YarnCurve curve;
    curve.repeat_offset = c % 3 == 0 ? V2i(1, 0) : c % 3 == 1 ? V2i(0, -1) : V2i(0, 0);
    curve.radius = unit * uniform(0.02F, 0.09F);
    curve.nodes = 12;
    curve.stations = 3;
    stations += curve.stations;
    // One after the other: compilers differ in the order of arguments.
    const float y = uniform(0, period.y);
    const V3f start(uniform(0, period.x), y, unit * 0.3F);
    for (int i = 0; i < curve.nodes; ++i) {
      const float fraction = static_cast<float>(i) / static_cast<float>(curve.nodes);
      const float angle = 2 * std::numbers::pi_v<float> * fraction;
      V3f at = start + V3f(std::cos(angle), std::sin(angle), std::sin(2 * angle)) * (unit * 0.2F);
      at += V3f(fraction * static_cast<float>(curve.repeat_offset.x) * period.x,
                fraction * static_cast<float>(curve.repeat_offset.y) * period.y, 0);
      data.nodes.push_back(at);
    }
    data.curves.push_back(curve);
  }
  data.station_light.assign(static_cast<std::size_t>(stations) * light_values_per_station, 0.0078125F);
  return data;
}

/// The same yarns, but for every second of plies, which meet themselves as others and turn in both senses.
inline YarnData plied(YarnData data) {
  for (std::size_t c = 0; c < data.curves.size(); c += 2) {
    const auto count = static_cast<int>(2 + c);
    const int shift = c % 4 == 0 ? 3 : -5;
    data.curves[c].plies = {count, 4, shift, 0.5F * static_cast<float>(c + 1), {-0.5F, 0.25F, 0.75F}};
  }
  return data;
}

/// The fabric with yarn, which 16 bits of light hold exactly.
inline Fabric with_yarn(Fabric fabric, std::uint64_t seed) {
  Random random(seed);
  fabric.levels.front().set_yarns(
      std::make_shared<const Yarns>(tangle(random, fabric.period_mm, 3), fabric.period_mm));
  return fabric;
}

/// Waves along x and, half a wave higher, along y, as smooth as fabrics; glossy, twisted, and lit by other
/// yarn at random.
inline YarnData waves(float period, int curves, bool strands) {
  constexpr int nodes = 48;
  YarnData data;
  Random random(3);
  for (int c = 0; c < curves; ++c) {
    YarnCurve curve;
    curve.nodes = nodes;
    curve.stations = 3;
    curve.repeat_offset = c % 2 == 0 ? V2i(1, 0) : V2i(0, 1);
    curve.radius = 0.08F * period;
    curve.albedo = {0.7F, 0.5F, 0.3F};
    curve.gloss = {0.2F, 0.4F};
    curve.fibre_slope = 0.5F;
    if (c % 2 == 1) curve.flattening = 0.6F;  // one round and one of plies
    if (c >= 2) curve.plies = {c, 3, 2 * c + 1, 0.5F, {-0.5F, 0.25F, 0.75F}};
    // Three quarters have strands: wide and thin ones, one as of yarn turned over.
    if (strands && c % 4 > 0)
      curve.strands = {c % 4 == 1 ? 9 : c % 4 == 2 ? -16 : 400, 5, 22, 7 * c, 0.1F, 3};
    data.curves.push_back(curve);
    const float side = (static_cast<float>(c / 2) + 0.5F) / static_cast<float>((curves + 1) / 2);
    for (int i = 0; i < nodes; ++i) {
      const float along = static_cast<float>(i) / nodes;
      const float wave = std::sin(2 * std::numbers::pi_v<float> * (along + 0.5F * side)) * 0.1F;
      const V3f node(along, side + wave, c % 2 == 0 ? 0.2F + wave : 0.2F - wave);
      data.nodes.push_back((c % 2 == 0 ? node : V3f(node.y, node.x, node.z)) * period);
    }
    for (int i = 0; i < curve.stations * light_values_per_station; ++i)
      data.station_light.push_back(static_cast<float>(0.02 * random.uniform()));
  }
  return data;
}

/// Rows and columns of stitches of 1 mm that hang over their borders, at random; `shapes`: of each stitch,
/// row by row from above. Rows run to the right and columns down.
inline YarnData lines_of(const V2i& size, std::span<const int> shapes) {
  constexpr int nodes_per_stitch = 20;
  YarnData data;
  for (int line = 0; line < size.y + size.x; ++line) {
    const bool is_row = line < size.y;
    YarnCurve curve;
    curve.repeat_offset = is_row ? V2i(1, 0) : V2i(0, -1);
    curve.radius = is_row ? 0.11F : 0.08F;
    curve.nodes = nodes_per_stitch * (is_row ? size.x : size.y);
    curve.stations = 1;
    data.curves.push_back(curve);
    for (int i = 0; i < curve.nodes; ++i) {
      const int stitch = i / nodes_per_stitch;
      const V2i at = is_row ? V2i(stitch, line) : V2i(line - size.y, stitch);
      Random random(2 * shapes[at.y * size.x + at.x] + (is_row ? 0 : 1));
      std::array<float, 3> reach{};
      for (float& r : reach) r = static_cast<float>(random.uniform() - 0.5);
      const float part = static_cast<float>(i % nodes_per_stitch) / nodes_per_stitch;
      // Level and straight at borders.
      const float bulge = std::pow(std::sin(std::numbers::pi_v<float> * part), 2.0F);
      const float turn = bulge * std::sin(2 * std::numbers::pi_v<float> * part);
      const float along = part - 0.8F * turn;
      const float across = 0.5F + 1.4F * reach[0] * bulge + 0.6F * reach[1] * turn;
      const float z = 0.5F + reach[2] * bulge;
      data.nodes.push_back(V3f(static_cast<float>(at.x) + (is_row ? along : across),
                               -static_cast<float>(at.y) - (is_row ? across : along), z));
    }
  }
  data.station_light.assign(data.curves.size() * light_values_per_station, 0);
  return data;
}

/// Its yarn but for the first curve gets strands, which shift, and changes of colour.
inline Fabric with_strands(Fabric fabric) {
  YarnData data = fabric.levels.front().yarns()->data();
  for (std::size_t c = 1; c < data.curves.size(); ++c) {
    const int number = static_cast<int>(c);
    data.curves[c].strands = {5 + 7 * number, 4 + number, 8 - 19 * number, 77 * number, 0.25F, 2 + number};
  }
  fabric.levels.front().set_yarns(std::make_shared<const Yarns>(std::move(data), fabric.period_mm));
  return fabric;
}

}  // namespace selvedge::test
