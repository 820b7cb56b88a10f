// Which parts and channels a fabric file has, and how the layers of a level become their pixels and back.
#pragma once

#include <array>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/exr/exr.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// The layers of a level, each of which is a part of the file, in the file's order.
enum class Layer { lobes, frame, table, opacity, light, heights, products, bases };
inline constexpr std::array all_layers{Layer::lobes, Layer::frame,   Layer::table,    Layer::opacity,
                                       Layer::light, Layer::heights, Layer::products, Layer::bases};
constexpr std::size_t index_of(Layer layer) { return static_cast<std::size_t>(layer); }

/// As its part is called.
const char* name_of(Layer layer);
std::optional<Layer> layer_named(std::string_view name);

/// Some of the layers.
class LayerSet {
 public:
  constexpr LayerSet() = default;
  constexpr LayerSet(std::initializer_list<Layer> layers) {
    for (const Layer layer : layers) insert(layer);
  }
  static constexpr LayerSet all() {
    LayerSet set;
    for (const Layer layer : all_layers) set.insert(layer);
    return set;
  }
  constexpr bool contains(Layer layer) const { return in_[index_of(layer)]; }
  constexpr bool empty() const { return *this == LayerSet(); }
  constexpr void insert(Layer layer) { in_[index_of(layer)] = true; }
  constexpr void insert(const LayerSet& others) {
    for (const Layer layer : all_layers) in_[index_of(layer)] = contains(layer) || others.contains(layer);
  }
  constexpr void erase(const LayerSet& others) {
    for (const Layer layer : all_layers) in_[index_of(layer)] = contains(layer) && !others.contains(layer);
  }
  constexpr bool operator==(const LayerSet&) const = default;

 private:
  std::array<bool, all_layers.size()> in_{};
};

/// Those that 16 bits are enough for.
inline constexpr LayerSet table_layers{Layer::frame,   Layer::table,    Layer::opacity, Layer::light,
                                       Layer::heights, Layer::products, Layer::bases};

/// All that the channels of the parts depend on. The same for all levels.
struct LayerShape {
  int lobes = 0;
  int views = 1;
  int lights = 1;
  SlabShape cells;
  int products = 0;        ///< coefficients of a texel, at the level with most
  int view_functions = 0;  ///< phi_0 not counted
  int light_functions = 0;
  int base_texels = 1;  ///< of level 0, which the bases' values are spread over
};

/// Of a fabric whose levels agree (validate()). Precondition: it has a level.
LayerShape shape_of(const Fabric& fabric);

/// Number of channels of a layer's part.
std::size_t channel_count(Layer layer, const LayerShape& shape);

/// Their names, in the order in which a texel's values lie in memory: of the lobes, channel by channel rho
/// and then the lobes' parameters; of table and opacity, view by view.
std::vector<std::string> channel_names(Layer layer, const LayerShape& shape);

bool has_layer(const FabricLevel& level, Layer layer);

/// A layer's value number `channel` (as in channel_names) of a texel; 0 where the layer has none.
/// Precondition: the level has the layer, and its arrays their sizes.
float value_of(const FabricLevel& level, Layer layer, const LayerShape& shape, std::size_t texel,
               std::size_t channel);

/// The pixels of a layer, planes in the order of channel_names; zeros where the level does not have it.
ExrPixels pixels_of(const FabricLevel& level, Layer layer, const LayerShape& shape);

/// The inverse: gives the level that layer. planes[i]: the texels' values of channel i of channel_names.
/// `pairs`: of the level's products, of which `entries` are kept in every texel.
void set_layer(FabricLevel& level, Layer layer, const LayerShape& shape,
               const std::vector<const std::vector<float>*>& planes, const std::vector<V2i>& pairs = {},
               int entries = 1);

}  // namespace selvedge
