// What a fabric file says of itself in its attribute text (spec/fabric.md), as a type.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "format/fabric/fabric.h"
#include "format/fabric/layers.h"

namespace selvedge {

/// One layer of the file.
struct LayerHeader {
  std::vector<int> levels;              ///< that have the layer; strictly increasing, at least one
  std::vector<std::string> digests;     ///< of the pixels of each of these levels
  bool half = true;                     ///< as the text says, for people: the part's channels decide
  int lobes = 0;                        ///< number of lobes; of Layer::lobes only
  SlabShape cells;                      ///< of Layer::heights only
  std::vector<std::vector<V2i>> pairs;  ///< of each of these levels; of Layer::products only
  int view_functions = 0;               ///< of Layer::bases only, phi_0 not counted
  int light_functions = 0;
};

struct FabricHeader {
  std::string model;  ///< for people
  int width = 1;      ///< texels of level 0
  int height = 1;
  int levels = 1;
  V2f period_mm{1, 1};
  float reference_height = 0;
  float thickness_mm = 0;
  float radiance_scale = 1;
  DirectionGrid views;
  DirectionGrid lights;                                              ///< of light tables and bases
  std::array<std::optional<LayerHeader>, all_layers.size()> layers;  ///< by Layer
  std::string provenance = "{}";
  std::optional<WholeFabric> whole;  ///< of a partial fabric

  const std::optional<LayerHeader>& layer(Layer which) const { return layers[index_of(which)]; }
  std::optional<LayerHeader>& layer(Layer which) { return layers[index_of(which)]; }
};

/// What a file of the fabric would say of it, as yet without its layers. Precondition: it has a level.
FabricHeader header_of(const Fabric& fabric);

/// The layer's entry for a level, an index into its levels and digests; -1 where the level does not have it.
int entry_of(const std::optional<LayerHeader>& layer, int level);

/// Texels of level 0 of the whole fabric, the level of it that is level 0 of the file, and its number of
/// levels as far as it is known.
V2i whole_texels(const FabricHeader& header);
int first_level(const FabricHeader& header);
int whole_levels(const FabricHeader& header);

/// "level 3" or "levels 3-4", for people.
std::string levels_text(int first, int last);

/// Which levels of the whole the file has and which it does not, for people; empty where it lacks none.
std::string missing_levels(const FabricHeader& header);

LayerShape shape_of(const FabricHeader& header);

/// Entries of a texel's products at a level: those of its heights, or one.
int entries_at(const FabricHeader& header, int level);

/// A fabric of that header that will have the levels `first` to `last` of the file, as yet without levels.
Fabric fabric_from_header(const FabricHeader& header, int first, int last);
/// All of them.
Fabric fabric_from_header(const FabricHeader& header);

}  // namespace selvedge
