// Yarn as the values of a file's layers, and back.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "format/fabric/fabric.h"
#include "format/fabric/yarns.h"

namespace selvedge {
namespace {

std::array<float, yarn_field_count> fields_of(const YarnCurve& c) {
  const auto floats = [](auto... values) {
    return std::array<float, yarn_field_count>{static_cast<float>(values)...};
  };
  const YarnPlies& p = c.plies;
  const YarnStrands& s = c.strands;
  return floats(c.nodes, c.stations, c.repeat_offset.x, c.repeat_offset.y, c.radius, c.albedo.x, c.albedo.y,
                c.albedo.z, c.gloss.weight, c.gloss.roughness, c.fibre_slope, p.count, p.divisions, p.shift,
                p.phase, p.outward_gain.x, p.outward_gain.y, p.outward_gain.z, s.count, s.noise_pieces,
                s.shift, s.seed, s.irregularity, s.swells, c.flattening, c.hairs.count, c.hairs.mean_length,
                c.hairs.loop_fraction, c.hairs.radius, c.hairs.opacity, c.squeezes.empty() ? 0 : 1,
                s.contrast, s.row_variation, p.sides, c.gloss.lustre, s.marl);
}

/// A whole number that a float holds; min - 1 for any other value.
int whole(float value, int min, int max) {
  return value >= static_cast<float>(min) && value <= static_cast<float>(max) && std::floor(value) == value
             ? static_cast<int>(value)
             : min - 1;
}

/// Appends each value of a station over all stations, or functions.
void append_by_value(const std::vector<float>& light, std::vector<float>& values) {
  for (std::size_t i = 0; i < light_values_per_station; ++i)
    for (std::size_t first = i; first < light.size(); first += light_values_per_station)
      values.push_back(light[first]);
}

}  // namespace

YarnCounts counts_of(const YarnData& data) {
  YarnCounts counts{static_cast<int>(data.curves.size()), static_cast<int>(data.nodes.size()), 0};
  counts.light_functions = data.packing.function_count();
  counts.step = data.packing.step;
  counts.map_size = data.map.size;
  for (const YarnCurve& curve : data.curves) {
    counts.stations += curve.stations;
    counts.nodes += static_cast<int>(curve.squeezes.size());
  }
  return counts;
}

std::vector<float> curve_values(const YarnData& data) {
  std::vector<float> values;
  for (int field = 0; field < yarn_field_count; ++field)
    for (const YarnCurve& curve : data.curves) values.push_back(fields_of(curve)[field]);
  const YarnPacking& packing = data.packing;
  for (int axis = 0; axis < values_per_node; ++axis) {
    const auto append = [&](std::span<const V3f> list, float step, bool straight) {
      if (packing.step == 0) {
        for (const V3f& value : list) values.push_back(value[axis]);
        return;
      }
      double last = 0;
      double slope = 0;
      for (std::size_t i = 0; i < list.size(); ++i) {
        const double steps = std::round(static_cast<double>(list[i][axis]) / static_cast<double>(step));
        values.push_back(static_cast<float>(steps - last - slope));
        if (straight && i > 0) slope = steps - last;
        last = steps;
      }
    };
    for_each_curve(data, [&](std::size_t, const YarnCurve& curve, std::span<const V3f> nodes) {
      append(nodes, packing.step, true);
      append(curve.squeezes, packed_squeeze_step, false);
    });
  }
  append_by_value(packing.functions, values);
  return values;
}

std::vector<float> indirect_values(const YarnData& data, bool through) {
  if (data.packing.step > 0) return through ? data.packing.factors_through : data.packing.factors;
  std::vector<float> values;
  append_by_value(through ? data.light_through : data.station_light, values);
  return values;
}

std::vector<float> unpacked_light(const YarnPacking& packing, const std::vector<float>& factors) {
  const auto functions = static_cast<std::size_t>(packing.function_count());
  const std::size_t stations = factors.size() / functions;
  std::vector<float> light(stations * light_values_per_station);
  for (std::size_t f = 0; f < functions; ++f)
    for (std::size_t s = 0; s < stations; ++s)
      for (std::size_t i = 0; i < light_values_per_station; ++i)
        light[s * light_values_per_station + i] +=
            factors[f * stations + s] * packing.functions[f * light_values_per_station + i];
  return light;
}

std::vector<float> light_from_values(std::span<const float> values, int stations) {
  std::vector<float> light(std::size_t{light_values_per_station} * stations);
  const int given = stations > 0 ? static_cast<int>(values.size()) / stations : 0;
  for (int i = 0; i < std::min(given, light_values_per_station); ++i)
    for (int s = 0; s < stations; ++s)
      light[std::size_t{light_values_per_station} * s + i] = values[std::size_t{1} * i * stations + s];
  return light;
}

void set_light_through(YarnData& data, std::span<const float> indirect) {
  const YarnCounts counts = counts_of(data);
  if (data.packing.step == 0) {
    data.light_through = light_from_values(indirect, counts.stations);
    return;
  }
  const auto factors = indirect.first(indirect_value_count(counts));
  data.packing.factors_through.assign(factors.begin(), factors.end());
  data.light_through = unpacked_light(data.packing, data.packing.factors_through);
}

YarnData turned_over(const Yarns& yarns, float thickness) {
  YarnData turned = yarns.data();
  turned.packing = {};
  for (V3f& node : turned.nodes) node.z = thickness - node.z;
  const bool known = !turned.light_through.empty();
  if (known) std::swap(turned.station_light, turned.light_through);
  std::size_t station = 0;
  for_each_curve(yarns.data(), [&](std::size_t index, const YarnCurve& own, std::span<const V3f> nodes) {
    YarnCurve& curve = turned.curves[index];
    curve.fibre_slope = -curve.fibre_slope;
    for (V3f& squeeze : curve.squeezes) squeeze.z = -squeeze.z;
    curve.strands.count = -curve.strands.count;
    curve.hairs.count = -curve.hairs.count;
    // Angles run the other way round; the direction that they count from is mirrored where it is sideways,
    // and is opposite to the mirrored one where it is upwards. Without light from below the upper side keeps
    // the angles, as in a mirror.
    const bool sideways = angles_from_x_axis(own, nodes, yarns.period());
    constexpr float half_turn = std::numbers::pi_v<float>;
    curve.plies.shift = -curve.plies.shift;
    if (curve.plies.count > 1)
      curve.plies.phase =
          sideways ? -curve.plies.phase : std::copysign(half_turn, curve.plies.phase) - curve.plies.phase;
    for (int s = 0; known && s < curve.stations; ++s, ++station) {
      for (auto* light : {&turned.station_light, &turned.light_through}) {
        float* c = &(*light)[station * light_values_per_station];
        for (int i = 1; i < angle_function_count; ++i) {
          const bool of_sides = own.plies.sides != 0;
          const bool of_sine = i == 2 || (of_sides && i == 4);
          const bool of_cosine = i == 1 || (of_sides && i == 3);
          const bool flips = (!of_sides && i == 4) || (sideways ? of_sine : of_cosine);
          for (int k = 0; flips && k < 3 * yarn_light_function_count; ++k)
            c[3 * yarn_light_function_count * i + k] *= -1;
          for (int n = 0; flips && n < light_moment_count; ++n)
            c[transfer_values_per_station + angle_function_count * n + i] *= -1;
        }
      }
    }
  });
  return turned;
}

YarnMap map_from_values(std::span<const float> values, const YarnCounts& counts, const V2i& kinds) {
  YarnMap map{.kinds = kinds, .size = counts.map_size, .shown = {}, .lines = {}};
  // Others than whole numbers become ones that validate() refuses.
  constexpr int last = std::numeric_limits<std::uint16_t>::max();
  for (const float value : values.first(counts.curves)) map.lines.push_back(whole(value, 0, last));
  for (const float value : values.subspan(counts.curves, std::size_t{1} * map.size.x * map.size.y))
    map.shown.push_back(static_cast<std::uint16_t>(whole(value, 0, last)));
  return map;
}

Result<YarnData> yarns_from_values(std::span<const float> curves, std::span<const float> indirect,
                                   const YarnCounts& counts, const V2f& period, YarnMap map) {
  YarnData data;
  data.map = std::move(map);
  std::vector<int> squeezes;  // of the curves
  constexpr int many = 1 << 24;
  const std::array<float, yarn_field_count> plain = fields_of({});
  for (int c = 0; c < counts.curves; ++c) {
    // The last fields may be missing; fields beyond the known ones are of later versions.
    const auto value = [&](int field) {
      return field < counts.values_per_curve ? curves[field * counts.curves + c] : plain[field];
    };
    const auto number = [&](int field) { return whole(value(field), -many, many); };
    const auto count = [&](int field) { return whole(value(field), 0, many); };
    YarnCurve curve;
    curve.nodes = count(0);
    curve.stations = count(1);
    curve.repeat_offset = {whole(value(2), -1024, 1024), whole(value(3), -1024, 1024)};
    curve.radius = value(4);
    curve.albedo = {value(5), value(6), value(7)};
    curve.gloss = {value(8), value(9), value(34)};
    curve.fibre_slope = value(10);
    const V3f outward_gain(value(15), value(16), value(17));
    curve.plies = {count(11), count(12), number(13), value(14), outward_gain, whole(value(33), 0, 1)};
    curve.strands = {number(18), count(19), number(20), count(21), value(22),
                     count(23),  value(31), value(32),  value(35)};
    curve.flattening = value(24);
    curve.hairs = {number(25), value(26), value(27), value(28), value(29)};
    squeezes.push_back(value(30) == 0 ? 0 : value(30) == 1 ? curve.nodes : 1);
    data.curves.push_back(std::move(curve));
  }
  const std::span<const float> nodes =
      curves.subspan(std::size_t{1} * counts.values_per_curve * counts.curves);
  YarnPacking& packing = data.packing;
  packing.step = counts.step;
  int next = 0;
  const auto take = [&](int count, float step, bool straight, std::vector<V3f>& to) {
    V3d last(0, 0, 0);
    V3d slope(0, 0, 0);
    for (int i = 0; i < count && next < counts.nodes; ++i, ++next) {
      const V3f value(nodes[next], nodes[counts.nodes + next], nodes[2 * counts.nodes + next]);
      if (step == 0) {
        to.push_back(value);
        continue;
      }
      if (i > 0 && straight) slope += V3d(value);
      last += i > 0 && straight ? slope : V3d(value);
      to.emplace_back(last * static_cast<double>(step));
    }
  };
  const bool is_packed = packing.step > 0;
  for (std::size_t c = 0; c < data.curves.size(); ++c) {
    take(data.curves[c].nodes, packing.step, true, data.nodes);
    take(squeezes[c], is_packed ? packed_squeeze_step : 0, false, data.curves[c].squeezes);
  }
  take(counts.nodes, 0, false, data.nodes);
  if (is_packed) {
    packing.functions =
        light_from_values(nodes.subspan(std::size_t{values_per_node} * counts.nodes), counts.light_functions);
    packing.factors.assign(indirect.begin(), indirect.begin() + indirect_value_count(counts));
    data.station_light = unpacked_light(packing, packing.factors);
  } else {
    data.station_light = light_from_values(indirect, counts.stations);
  }
  if (auto ok = validate(data, period); !ok) return tl::unexpected(ok.error());
  return data;
}

}  // namespace selvedge
