// Which parts and channels a fabric file has, and how the layers of a level become their pixels and back.
#pragma once

#include <array>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/exr.h"
#include "format/fabric.h"

namespace selvedge {

/// The layers of a level, each of which is a part of the file, in the file's order.
enum class Layer { lobes, frame, table, opacity };
inline constexpr std::array<Layer, 4> all_layers{Layer::lobes, Layer::frame, Layer::table, Layer::opacity};
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
  static constexpr LayerSet all() { return {Layer::lobes, Layer::frame, Layer::table, Layer::opacity}; }
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
  std::array<bool, 4> in_{};
};

/// Those that 16 bits are enough for.
inline constexpr LayerSet table_layers{Layer::frame, Layer::table, Layer::opacity};

/// Number of channels of a layer's part, with `lobes` lobes and `views` views.
std::size_t channel_count(Layer layer, int lobes, int views);

/// Their names, in the order in which a texel's values lie in memory: of the lobes, channel by channel rho
/// and then the lobes' parameters; of table and opacity, view by view.
std::vector<std::string> channel_names(Layer layer, int lobes, int views);

bool has_layer(const FabricLevel& level, Layer layer);

/// A layer's value number `channel` of `channels` (as in channel_names) of a texel. Precondition: the level
/// has the layer, and its arrays their sizes.
float value_of(const FabricLevel& level, Layer layer, std::size_t texel, std::size_t channel,
               std::size_t channels);

/// The pixels of a layer, planes in the order of channel_names; zeros where the level does not have it.
ExrPixels pixels_of(const FabricLevel& level, Layer layer, int lobes, int views);

/// The inverse: gives the level that layer. planes[i]: the texels' values of channel i of channel_names.
void set_layer(FabricLevel& level, Layer layer, int lobes,
               const std::vector<const std::vector<float>*>& planes);

}  // namespace selvedge
