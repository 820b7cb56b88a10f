// What a fabric file says of itself in its attribute text (spec/fabric.md), as a type.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "format/fabric/fabric.h"

namespace selvedge {

/// One layer of the file.
struct LayerHeader {
  std::vector<int> levels;              ///< that have the layer; strictly increasing, at least one
  std::vector<std::string> digests;     ///< of the pixels of each of these levels
  bool half = true;                     ///< as the text says, for people: the part's channels decide
  std::vector<std::vector<V2i>> pairs;  ///< of each of these levels; of LayerKind::products only
};

/// What is known of a file before its pixels are read.
struct FabricHeader : FabricInfo {
  std::string model;  ///< for people
  int width = 1;      ///< texels of level 0
  int height = 1;
  int levels = 1;
  LayerShape shape;                                                  ///< of the layers that there are
  std::array<std::optional<LayerHeader>, all_layers.size()> layers;  ///< by LayerKind

  V2i texels() const { return {width, height}; }
  const std::optional<LayerHeader>& layer(LayerKind kind) const { return layers[index_of(kind)]; }
  std::optional<LayerHeader>& layer(LayerKind kind) { return layers[index_of(kind)]; }
  /// The layer's entry for a level, an index into its levels and digests; -1 where the level does not have
  /// it.
  int entry(LayerKind kind, int level) const;
  bool has(LayerKind kind, int level) const { return entry(kind, level) >= 0; }
};

/// What a file of the fabric would say of it, as yet without its layers. Precondition: it has a level.
FabricHeader header_without_layers(const Fabric& fabric);

/// Number of levels of the whole fabric as far as it is known.
int whole_levels(const FabricHeader& header);

/// "level 3" or "levels 3-4", for people.
std::string levels_text(int first, int last);

/// Which levels of the whole the file has and which it does not, for people; empty where it lacks none.
std::string missing_levels(const FabricHeader& header);

/// Entries of a texel's products at a level: those of its heights, or one.
int entries_at(const FabricHeader& header, int level);

/// The part of the file that has its levels `first` to `last` alone: a fabric without its levels.
Fabric part_of(const FabricHeader& header, int first, int last);

}  // namespace selvedge
