// The header of a fabric file: the attribute text of spec/fabric.md as a type.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// One layer of the file.
struct LayerHeader {
  std::vector<int> levels;              ///< levels that have the layer; strictly increasing, at least one
  std::vector<std::string> digests;     ///< of the pixels of each of these levels
  std::vector<std::vector<V2i>> pairs;  ///< of each of these levels; LayerKind::products only
};

/// Everything that is known of a file before its pixels are read.
struct FabricHeader : FabricInfo {
  int width = 1;  ///< texels of level 0
  int height = 1;
  int levels = 1;
  LayerShape shape;                                                  ///< of the layers in the file
  std::array<std::optional<LayerHeader>, all_layers.size()> layers;  ///< by LayerKind
  std::vector<FabricHeader> sides;                                   ///< the other sides; of the front only

  V2i texels() const { return {width, height}; }
  const std::optional<LayerHeader>& layer(LayerKind kind) const { return layers[index_of(kind)]; }
  std::optional<LayerHeader>& layer(LayerKind kind) { return layers[index_of(kind)]; }
  /// Index of a level in the layer's levels and digests; -1 if the level does not have the layer.
  int index_in_layer(LayerKind kind, int level) const;
  bool has(LayerKind kind, int level) const { return index_in_layer(kind, level) >= 0; }
  /// The level whose texels a level shows: itself, or of another side that leaves it out, the next coarser
  /// one that it has; -1 without any.
  int texel_level(int level) const;
  /// This header or one of its sides; null without.
  const FabricHeader* find_side(Side wanted) const;
};

/// Calls `visit` with the header and the headers of its other sides.
template <class Visit>
void for_each_side(const FabricHeader& header, const Visit& visit) {
  visit(header);
  for (const FabricHeader& other : header.sides) visit(other);
}

/// The header of a fabric's file but for its layers and other sides. Precondition: the fabric has a level.
FabricHeader header_without_layers(const Fabric& fabric);

/// The attribute text of a file.
std::string header_to_json(FabricHeader header);

/// The inverse. Adds issues for text that is not JSON, another version, and members that break a rule; then
/// there is no header.
std::optional<FabricHeader> header_from_json(const std::string& text, const FabricLimits& limits,
                                             IssueSink& sink);

}  // namespace selvedge
