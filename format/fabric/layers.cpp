#include "format/fabric/layers.h"

#include <fmt/format.h>

#include <cstdint>

#include "format/exr/exr.h"
#include "format/fabric/lafortune.h"
#include "format/fabric/names.h"
#include "format/fabric/yarns.h"

namespace selvedge {
namespace {

constexpr ValueRange finite;
constexpr ValueRange not_negative{0, std::numeric_limits<float>::max(), "is negative or not finite"};
constexpr ValueRange fraction{0, 1, "is outside of [0, 1]"};

/// Channels are, for each colour, rho, then the parameters of every lobe.
std::string lobe_channel(const LayerShape& shape, int channel) {
  const int per_colour = parameter_count(shape.lobes);
  const char* colour = names::colour_suffix[channel / per_colour];
  const int k = channel % per_colour - 1;
  if (k < 0) return fmt::format("diffuse.{}", colour);
  return fmt::format("{}.{}.{}", k / 4, names::lobe_parameters[k % 4], colour);
}

std::string colour_of_direction(const LayerShape&, int channel) {
  return fmt::format("{:04}.{}", channel / 3, names::colour_suffix[channel % 3]);
}

std::string number(const LayerShape&, int channel) { return fmt::format("{}", channel); }

/// Channels of a part whose values are spread over the texels of level 0.
int channels_of(std::int64_t values, const LayerShape& shape) {
  return static_cast<int>((values + shape.level0_texel_count - 1) / shape.level0_texel_count);
}

ValueRange all_finite(const LayerShape&, int) { return finite; }
ValueRange all_not_negative(const LayerShape&, int) { return not_negative; }

/// The properties of a kind of layer.
struct LayerRow {
  const char* part;
  int (*count)(const LayerShape&);
  std::string (*channel)(const LayerShape&, int);  ///< name of a channel, without the part's
  ValueRange (*range)(const LayerShape&, int);
};

/// By LayerKind.
constexpr std::array<LayerRow, all_layers.size()> rows{{
    {"lobes", [](const LayerShape& s) { return 3 * parameter_count(s.lobes); }, lobe_channel,
     // rho, and the lobes' exponents
     [](const LayerShape& s, int i) {
       return i % parameter_count(s.lobes) % 4 == 0 ? not_negative : finite;
     }},
    {"frame", [](const LayerShape&) { return 6; },
     [](const LayerShape&, int i) { return std::string(names::frame_channels[i]); }, all_finite},
    {"table", [](const LayerShape& s) { return 3 * s.views; }, colour_of_direction, all_not_negative},
    {"opacity", [](const LayerShape& s) { return s.views; },
     [](const LayerShape&, int i) { return fmt::format("{:04}", i); },
     [](const LayerShape&, int) { return fraction; }},
    {"light", [](const LayerShape& s) { return 3 * s.lights; }, colour_of_direction, all_not_negative},
    {"products", [](const LayerShape& s) { return s.products; }, number, all_finite},
    {"bases",
     [](const LayerShape& s) {
       return channels_of(s.view_functions * s.views + 3 * s.light_functions * s.lights, s);
     },
     number, all_finite},
    {names::part_yarns, [](const LayerShape& s) { return channels_of(curve_value_count(s.yarns), s); },
     number, all_finite},
    {names::part_indirect, [](const LayerShape& s) { return channels_of(indirect_value_count(s.yarns), s); },
     number, all_finite},
    {"map",
     [](const LayerShape& s) {
       return channels_of(s.yarns.curves + std::int64_t{1} * s.yarns.map_size.x * s.yarns.map_size.y, s);
     },
     number, all_finite},
}};

const LayerRow& row_of(LayerKind kind) { return rows[index_of(kind)]; }

}  // namespace

const char* name_of(LayerKind kind) { return row_of(kind).part; }

const char* name_of(Side side) {
  constexpr std::array names{"front", "back", "through", "back.through"};
  return names[index_of(side)];
}

LayerSet side_layers(Side side) {
  LayerSet set = LayerSet::all();
  if (side != Side::front) set.erase({LayerKind::yarns, LayerKind::map});
  if (is_view_behind(side)) set.erase({LayerKind::indirect});
  if (is_transmission(side)) set.erase({LayerKind::opacity});
  return set;
}

std::string part_name(LayerKind kind, Side side) {
  return side == Side::front ? name_of(kind) : fmt::format("{}.{}", name_of(side), name_of(kind));
}

std::optional<LayerKind> find_layer_kind(std::string_view name) {
  for (const LayerKind kind : all_layers)
    if (name == name_of(kind)) return kind;
  return std::nullopt;
}

int channel_count(LayerKind kind, const LayerShape& shape) { return row_of(kind).count(shape); }

bool fits_exr_part(LayerKind kind, const LayerShape& shape) {
  return channel_count(kind, shape) <= ExrLimits{}.channels;
}

std::string channel_name(LayerKind kind, const LayerShape& shape, int channel) {
  return fmt::format("{}.{}", part_name(kind, shape.side), row_of(kind).channel(shape, channel));
}

std::vector<std::string> channel_names(LayerKind kind, const LayerShape& shape) {
  std::vector<std::string> names;
  for (int i = 0; i < channel_count(kind, shape); ++i) names.push_back(channel_name(kind, shape, i));
  return names;
}

ValueRange value_range(LayerKind kind, const LayerShape& shape, int channel) {
  return row_of(kind).range(shape, channel);
}

}  // namespace selvedge
