#include "format/fabric/header.h"

#include <algorithm>

namespace selvedge {
FabricHeader header_without_layers(const Fabric& fabric) {
  FabricHeader header;
  static_cast<FabricInfo&>(header) = fabric;
  header.width = fabric.levels.front().width;
  header.height = fabric.levels.front().height;
  header.levels = static_cast<int>(fabric.levels.size());
  header.shape = shape_of(fabric);
  return header;
}

const FabricHeader* FabricHeader::side_of(Side wanted) const {
  if (wanted == side) return this;
  const auto found = std::ranges::find_if(sides, [&](const FabricHeader& h) { return h.side == wanted; });
  return found == sides.end() ? nullptr : &*found;
}

int FabricHeader::entry(LayerKind kind, int level) const {
  if (!layer(kind)) return -1;
  const std::vector<int>& present = layer(kind)->levels;
  const auto found = std::ranges::find(present, level);
  return found == present.end() ? -1 : static_cast<int>(found - present.begin());
}

int FabricHeader::level_of_texels(int level) const {
  if (side == Side::front) return level;
  constexpr std::array reflecting{LayerKind::lobes, LayerKind::table, LayerKind::light, LayerKind::products};
  for (int k = level; k < levels; ++k) {
    if (std::ranges::any_of(reflecting, [&](LayerKind kind) { return has(kind, k); })) return k;
  }
  return -1;
}

}  // namespace selvedge
