// Yarn as the values of a file's layers, and back.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/fabric/fabric.h"
#include "format/fabric/yarns.h"

namespace selvedge {
namespace {

std::array<float, yarn_field_count> fields_of(const YarnCurve& c) {
  const YarnPlies& p = c.plies;
  const YarnStrands& s = c.strands;
  return {static_cast<float>(c.nodes),
          static_cast<float>(c.stations),
          static_cast<float>(c.repeat_offset.x),
          static_cast<float>(c.repeat_offset.y),
          c.radius,
          c.albedo.x,
          c.albedo.y,
          c.albedo.z,
          c.gloss.weight,
          c.gloss.roughness,
          c.fibre_slope,
          static_cast<float>(p.count),
          static_cast<float>(p.divisions),
          static_cast<float>(p.shift),
          p.phase,
          p.outward_gain.x,
          p.outward_gain.y,
          p.outward_gain.z,
          static_cast<float>(s.count),
          static_cast<float>(s.noise_pieces),
          static_cast<float>(s.shift),
          static_cast<float>(s.seed),
          s.irregularity,
          static_cast<float>(s.swells),
          c.flattening,
          static_cast<float>(c.hairs.count),
          c.hairs.mean_length,
          c.hairs.loop_fraction,
          c.hairs.radius,
          c.hairs.opacity,
          c.squeezes.empty() ? 0.0F : 1.0F,
          s.contrast,
          s.row_variation,
          static_cast<float>(p.sides),
          c.gloss.lustre,
          s.marl};
}

/// A whole number that a float holds; min - 1 for any other value.
int whole(float value, int min, int max) {
  return value >= static_cast<float>(min) && value <= static_cast<float>(max) && std::floor(value) == value
             ? static_cast<int>(value)
             : min - 1;
}

}  // namespace

YarnCounts counts_of(const YarnData& data) {
  YarnCounts counts{static_cast<int>(data.curves.size()), static_cast<int>(data.nodes.size()), 0};
  if (const YarnCopies& p = data.copies; p.nodes > 0) {
    counts.pieces = static_cast<int>(p.kind_of.size());
    counts.kinds = p.kinds();
    counts.nodes_per_piece = p.nodes;
    counts.stations_per_piece = p.stations;
    counts.nodes = counts.pieces + static_cast<int>(p.shape.size() + p.squeezes.size());
    counts.stations = counts.kinds * p.stations;
    return counts;
  }
  for (const YarnCurve& curve : data.curves) {
    counts.stations += curve.stations;
    counts.nodes += static_cast<int>(curve.squeezes.size());
  }
  return counts;
}

std::vector<float> curve_values(const YarnData& data) {
  std::vector<float> values;
  for (int field = 0; field < yarn_field_count; ++field) {
    for (const YarnCurve& curve : data.curves) values.push_back(fields_of(curve)[field]);
  }
  const YarnCopies& pieces = data.copies;
  for (int axis = 0; axis < values_per_node; ++axis) {
    for (const auto* list : {&pieces.starts, &pieces.shape, &pieces.squeezes})
      for (const V3f& value : *list) values.push_back(value[axis]);
    if (pieces.nodes > 0) continue;
    for_each_curve(data, [&](std::size_t, const YarnCurve& curve, std::span<const V3f> nodes) {
      for (const V3f& node : nodes) values.push_back(node[axis]);
      for (const V3f& squeeze : curve.squeezes) values.push_back(squeeze[axis]);
    });
  }
  values.insert(values.end(), pieces.kind_of.begin(), pieces.kind_of.end());
  return values;
}

std::vector<float> indirect_values(const YarnData& data, bool through) {
  std::vector<float> values;
  const YarnCopies& pieces = data.copies;
  const std::vector<float>& light = pieces.nodes == 0 ? (through ? data.light_through : data.station_light)
                                    : through         ? pieces.light_through
                                                      : pieces.light;
  const std::size_t stations = light.size() / light_values_per_station;
  for (std::size_t i = 0; i < light_values_per_station; ++i) {
    for (std::size_t s = 0; s < stations; ++s) values.push_back(light[s * light_values_per_station + i]);
  }
  return values;
}

std::vector<float> light_from_values(std::span<const float> indirect, int stations) {
  std::vector<float> light(std::size_t{light_values_per_station} * stations);
  const int given = stations > 0 ? static_cast<int>(indirect.size()) / stations : 0;
  for (int i = 0; i < std::min(given, light_values_per_station); ++i) {
    for (int s = 0; s < stations; ++s) {
      light[std::size_t{light_values_per_station} * s + i] = indirect[std::size_t{1} * i * stations + s];
    }
  }
  return light;
}

void set_light_through(YarnData& data, std::span<const float> indirect, const V2f& period) {
  std::vector<float> light = light_from_values(indirect, counts_of(data).stations);
  if (data.copies.nodes == 0) {
    data.light_through = std::move(light);
    return;
  }
  data.copies.light_through = std::move(light);
  expand_copies(data, period);
}

YarnData turned_over(const Yarns& yarns, float thickness) {
  YarnData turned = yarns.data();
  turned.copies = {};
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

namespace {

tl::unexpected<Error> refuse_pieces(std::string why, const std::string& place = "pieces") {
  return fail(Code::fabric_malformed, {}, place, std::move(why));
}

/// Sets the pieces of the curves and where they begin. `vectors`: what follows the fields of the curves;
/// `squeezes`: of each curve.
Result<void> take_pieces(std::span<const float> vectors, std::span<const float> indirect,
                         const YarnCounts& counts, const std::vector<int>& squeezes, YarnData& data) {
  YarnCopies& pieces = data.copies;
  pieces.nodes = counts.nodes_per_piece;
  pieces.stations = counts.stations_per_piece;
  std::int64_t nodes = 0;
  std::int64_t stations = 0;
  for (std::size_t c = 0; c < data.curves.size(); ++c) {
    YarnCurve& curve = data.curves[c];
    if (curve.nodes < 1 || curve.nodes % pieces.nodes != 0 || curve.stations < 1)
      return refuse_pieces("has no whole number of pieces", fmt::format("curve {}", c));
    nodes += curve.nodes;
    stations += curve.stations;
    if (squeezes[c] != 0 && squeezes[c] != curve.nodes)
      return refuse_pieces("is neither squashed nor round", fmt::format("curve {}", c));
    if (squeezes[c] > 0) curve.squeezes.resize(1);
  }
  if (nodes != std::int64_t{1} * counts.pieces * pieces.nodes)
    return refuse_pieces("there are not as many as the curves have");
  if (nodes > max_piece_count || stations > FabricLimits{}.stations)
    return refuse_pieces("have more nodes or stations than a repeat may have");
  const auto vector_at = [&](int i) {
    return V3f(vectors[i], vectors[counts.nodes + i], vectors[2 * counts.nodes + i]);
  };
  const int shapes = counts.kinds * pieces.nodes;
  for (int i = 0; i < counts.pieces; ++i) {
    pieces.starts.push_back(vector_at(i));
    pieces.kind_of.push_back(whole(vectors[values_per_node * counts.nodes + i], 0, counts.kinds - 1));
    if (pieces.kind_of.back() < 0) return refuse_pieces("has no kind", fmt::format("piece {}", i));
  }
  for (int i = counts.pieces; i < counts.nodes; ++i)
    (i < counts.pieces + shapes ? pieces.shape : pieces.squeezes).push_back(vector_at(i));
  const bool squashed = std::ranges::any_of(squeezes, [](int count) { return count > 0; });
  if (pieces.squeezes.size() != (squashed ? pieces.shape.size() : 0))
    return refuse_pieces("need one squeeze per node of squashed curves");
  pieces.light = light_from_values(indirect, counts.stations);
  return {};
}

}  // namespace

Result<YarnData> yarns_from_values(std::span<const float> curves, std::span<const float> indirect,
                                   const YarnCounts& counts, const V2f& period) {
  YarnData data;
  std::vector<int> squeezes;  // of the curves
  constexpr int many = 1 << 24;
  const std::array<float, yarn_field_count> plain = fields_of({});
  for (int c = 0; c < counts.curves; ++c) {
    // The last fields may be missing; fields beyond the known ones are of later versions.
    const auto value = [&](int field) {
      return field < counts.values_per_curve ? curves[field * counts.curves + c] : plain[field];
    };
    YarnCurve curve;
    curve.nodes = whole(value(0), 0, many);
    curve.stations = whole(value(1), 0, many);
    curve.repeat_offset = {whole(value(2), -1024, 1024), whole(value(3), -1024, 1024)};
    curve.radius = value(4);
    curve.albedo = {value(5), value(6), value(7)};
    curve.gloss = {value(8), value(9), value(34)};
    curve.fibre_slope = value(10);
    curve.plies = {whole(value(11), 0, many),         whole(value(12), 0, many),
                   whole(value(13), -many, many),     value(14),
                   {value(15), value(16), value(17)}, whole(value(33), 0, 1)};
    curve.strands = {whole(value(18), -many, many),
                     whole(value(19), 0, many),
                     whole(value(20), -many, many),
                     whole(value(21), 0, many),
                     value(22),
                     whole(value(23), 0, many),
                     value(31),
                     value(32),
                     value(35)};
    curve.flattening = value(24);
    curve.hairs = {whole(value(25), -many, many), value(26), value(27), value(28), value(29)};
    squeezes.push_back(value(30) == 0 ? 0 : value(30) == 1 ? curve.nodes : 1);
    data.curves.push_back(std::move(curve));
  }
  const std::span<const float> nodes =
      curves.subspan(std::size_t{1} * counts.values_per_curve * counts.curves);
  if (counts.pieces > 0) {
    if (auto ok = take_pieces(nodes, indirect, counts, squeezes, data); !ok)
      return tl::unexpected(ok.error());
    expand_copies(data, period);
    if (auto ok = validate(data, period); !ok) return tl::unexpected(ok.error());
    return data;
  }
  int next = 0;
  const auto take = [&](int count, std::vector<V3f>& to) {
    for (; count > 0 && next < counts.nodes; --count, ++next)
      to.emplace_back(nodes[next], nodes[counts.nodes + next], nodes[2 * counts.nodes + next]);
  };
  for (std::size_t c = 0; c < data.curves.size(); ++c) {
    take(data.curves[c].nodes, data.nodes);
    take(squeezes[c], data.curves[c].squeezes);
  }
  take(counts.nodes, data.nodes);
  data.station_light = light_from_values(indirect, counts.stations);
  if (auto ok = validate(data, period); !ok) return tl::unexpected(ok.error());
  return data;
}

}  // namespace selvedge
