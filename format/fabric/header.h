// The header of a fabric file: the attribute text of spec/fabric.md as a type.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "format/fabric/fabric.h"

namespace selvedge {

/// One layer of the file.
struct LayerHeader {
  std::vector<int> levels;              ///< levels that have the layer; strictly increasing, at least one
  std::vector<std::string> digests;     ///< of the pixels of each of these levels
  bool half = true;                     ///< for information only: the part's channels decide
  std::vector<std::vector<V2i>> pairs;  ///< of each of these levels; LayerKind::products only
};

/// Everything that is known of a file before its pixels are read.
struct FabricHeader : FabricInfo {
  std::string model;  ///< for information only
  int width = 1;      ///< texels of level 0
  int height = 1;
  int levels = 1;
  LayerShape shape;                                                  ///< of the layers in the file
  std::array<std::optional<LayerHeader>, all_layers.size()> layers;  ///< by LayerKind
  std::vector<FabricHeader> sides;                                   ///< the other sides; of the front only

  V2i texels() const { return {width, height}; }
  const std::optional<LayerHeader>& layer(LayerKind kind) const { return layers[index_of(kind)]; }
  std::optional<LayerHeader>& layer(LayerKind kind) { return layers[index_of(kind)]; }
  /// Index of a level in the layer's levels and digests; -1 if the level does not have the layer.
  int entry(LayerKind kind, int level) const;
  bool has(LayerKind kind, int level) const { return entry(kind, level) >= 0; }
  /// The level whose texels a level shows: itself, or of another side that leaves it out, the next coarser
  /// one that it has; -1 where there is none.
  int level_of_texels(int level) const;
  /// This header or one of its sides; null without.
  const FabricHeader* side_of(Side wanted) const;
};

/// Calls `visit` with the header and those of its other sides.
template <class Visit>
void for_each_side(const FabricHeader& header, const Visit& visit) {
  visit(header);
  for (const FabricHeader& other : header.sides) visit(other);
}

/// The header of a fabric's file but for its layers and other sides. Precondition: the fabric has a level.
FabricHeader header_without_layers(const Fabric& fabric);

/// Minor version of the file: 1 with other sides than the front, 2 with more than round yarn, 3 with flat
/// sections or hairs.
inline int minor_version(const FabricHeader& header) {
  if (header.shape.yarns.fields > fields_with_strands) return 3;
  if (header.shape.yarns.fields > fields_of_round_yarn) return 2;
  return header.sides.empty() ? 0 : 1;
}

/// Number of levels of the whole fabric; if it is unknown, up to the last level of the file.
int whole_levels(const FabricHeader& header);

/// "level 3" or "levels 3-4".
std::string levels_text(int first, int last);

/// A sentence about the levels of the whole that the file has and lacks; empty if it lacks none.
std::string missing_levels(const FabricHeader& header);

/// A fabric with the properties of levels [first, last] of the file; its levels are left empty.
Fabric partial_fabric(const FabricHeader& header, int first, int last);

}  // namespace selvedge
