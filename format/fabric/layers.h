// The layers of a level as data: their kinds, and the parts, channels and ranges of each kind.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/base/vec.h"

namespace selvedge {

/// Each kind is a part of the file. In the file's order.
enum class LayerKind { lobes, frame, table, opacity, light, products, bases, yarns, indirect, map };
inline constexpr std::array all_layers{
    LayerKind::lobes,    LayerKind::frame, LayerKind::table, LayerKind::opacity,  LayerKind::light,
    LayerKind::products, LayerKind::bases, LayerKind::yarns, LayerKind::indirect, LayerKind::map};
constexpr std::size_t index_of(LayerKind kind) { return static_cast<std::size_t>(kind); }

/// The name of the kind, and of its part at the front.
const char* name_of(LayerKind kind);
std::optional<LayerKind> find_layer_kind(std::string_view name);

/// On which sides of the cloth view and light are (spec/brdf.md, Sides). In the file's order.
enum class Side {
  front,        ///< both in front
  back,         ///< both behind
  through,      ///< the view in front, the light behind
  back_through  ///< the view behind, the light in front
};
inline constexpr std::array all_sides{Side::front, Side::back, Side::through, Side::back_through};
inline constexpr std::array other_sides{Side::back, Side::through, Side::back_through};
constexpr std::size_t index_of(Side side) { return static_cast<std::size_t>(side); }
constexpr bool is_view_behind(Side side) { return side == Side::back || side == Side::back_through; }
constexpr bool is_transmission(Side side) { return side == Side::through || side == Side::back_through; }

/// "front", "back", "through", "back.through".
const char* name_of(Side side);

class LayerSet {
 public:
  constexpr LayerSet() = default;
  constexpr LayerSet(std::initializer_list<LayerKind> kinds) {
    for (const LayerKind kind : kinds) insert(kind);
  }
  static constexpr LayerSet all() {
    LayerSet set;
    for (const LayerKind kind : all_layers) set.insert(kind);
    return set;
  }
  constexpr bool contains(LayerKind kind) const { return (bits_ >> index_of(kind) & 1U) != 0; }
  constexpr void insert(LayerKind kind) { bits_ |= 1U << index_of(kind); }
  constexpr void erase(const LayerSet& others) { bits_ &= ~others.bits_; }
  constexpr bool operator==(const LayerSet&) const = default;

 private:
  std::uint32_t bits_ = 0;  ///< by kind
};

/// Layers for which 16 bits suffice.
inline constexpr LayerSet half_precision_layers = [] {
  LayerSet set = LayerSet::all();
  set.erase({LayerKind::lobes, LayerKind::yarns, LayerKind::map});
  return set;
}();

/// The layers that a side may have in a file. The yarn and the opacity of a view are stored once.
LayerSet side_layers(Side side);

/// Values of a level's texels: values[texel * channels + channel], with the channels of channel_name(). A
/// layer without channels is absent.
struct Layer {
  int channels = 0;
  std::vector<float> values;
  bool operator==(const Layer&) const = default;
};

/// Numbers of a curve: all, and the least that a file may have.
inline constexpr int yarn_field_count = 36;
inline constexpr int min_yarn_field_count = 11;
/// Numbers of a station of indirect light, likewise.
inline constexpr int station_value_count = 145;
inline constexpr int min_station_value_count = 135;

/// How much yarn a fabric holds (yarns.h); 0: none.
struct YarnCounts {
  int curves = 0;
  int nodes = 0;                            ///< and squeezes of squashed curves
  int stations = 0;                         ///< of indirect light
  int values_per_curve = yarn_field_count;  ///< numbers of a curve
  int values_per_station = station_value_count;
  int light_functions = 0;  ///< of packed yarn (YarnPacking); 0: it is not packed
  float step = 0;           ///< mm, of packed nodes
  V2i map_size{0, 0};       ///< YarnMap::size
  bool operator==(const YarnCounts&) const = default;
};

/// The counts that define the channels of a fabric's parts. The same for all levels.
struct LayerShape {
  Side side = Side::front;
  int lobes = 0;
  int views = 1;
  int lights = 1;
  int products = 0;        ///< largest number at any level
  int view_functions = 0;  ///< without phi_0
  int light_functions = 0;
  YarnCounts yarns{};
  int level0_texel_count =
      1;  ///< of level 0, which the values of bases, yarns and indirect light are spread over
};

/// The name of a layer's part: its kind's, after "back." and the like for other sides than the front.
std::string part_name(LayerKind kind, Side side);

/// Number of channels of a layer's part.
int channel_count(LayerKind kind, const LayerShape& shape);

/// Whether an OpenEXR part can have the channels. To be checked before channel_names(): a short attribute
/// text can define millions.
bool fits_exr_part(LayerKind kind, const LayerShape& shape);

std::string channel_name(LayerKind kind, const LayerShape& shape, int channel);
std::vector<std::string> channel_names(LayerKind kind, const LayerShape& shape);

/// A range of valid values, and the message for values outside. No range contains NaN or infinities.
struct ValueRange {
  float min = std::numeric_limits<float>::lowest();
  float max = std::numeric_limits<float>::max();
  const char* fault_message = "is not finite";
  bool contains(float value) const { return value >= min && value <= max; }
};
ValueRange value_range(LayerKind kind, const LayerShape& shape, int channel);

}  // namespace selvedge
