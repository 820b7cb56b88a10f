#include "format/fabric/header.h"

#include <fmt/format.h>

#include <algorithm>

namespace selvedge {
namespace {

std::string model_of(const Fabric& fabric) {
  const FabricLevel& base = fabric.levels.front();
  std::string model = base.has(LayerKind::lobes) ? "lafortune" : "constant";
  if (base.has(LayerKind::table)) model += "-view-table";
  if (base.has(LayerKind::light)) model += "-light-table";
  if (base.has(LayerKind::products)) model += "-products";
  return model;
}

}  // namespace

FabricHeader header_without_layers(const Fabric& fabric) {
  FabricHeader header;
  static_cast<FabricInfo&>(header) = fabric;
  header.model = model_of(fabric);
  header.width = fabric.levels.front().width;
  header.height = fabric.levels.front().height;
  header.levels = static_cast<int>(fabric.levels.size());
  header.shape = shape_of(fabric);
  return header;
}

const FabricHeader* FabricHeader::side_of(Side wanted) const {
  if (wanted == side) return this;
  const auto found =
      std::find_if(sides.begin(), sides.end(), [&](const FabricHeader& h) { return h.side == wanted; });
  return found == sides.end() ? nullptr : &*found;
}

int FabricHeader::entry(LayerKind kind, int level) const {
  if (!layer(kind)) return -1;
  const std::vector<int>& present = layer(kind)->levels;
  const auto found = std::find(present.begin(), present.end(), level);
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

int whole_levels(const FabricHeader& header) {
  return std::max(header.whole ? header.whole->levels : 0, header.first_level() + header.levels);
}

namespace {

std::string range_text(int first, int last) {
  return first == last ? fmt::format("{}", first) : fmt::format("{}-{}", first, last);
}

}  // namespace

std::string levels_text(int first, int last) {
  return (first == last ? "level " : "levels ") + range_text(first, last);
}

std::string missing_levels(const FabricHeader& header) {
  const int first = header.first_level();
  const int beyond = first + header.levels;
  const int all = whole_levels(header);
  std::string missing;
  if (first > 0) missing = range_text(0, first - 1);
  if (beyond < all) missing += (missing.empty() ? "" : " and ") + range_text(beyond, all - 1);
  if (missing.empty()) return missing;
  const bool single = all - header.levels == 1;
  const V2i texels = whole_texels(header);
  return fmt::format("has {} of a whole of {}x{} texels; level{} {} of {} {} missing",
                     levels_text(first, beyond - 1), texels.x, texels.y, single ? "" : "s", missing, all,
                     single ? "is" : "are");
}

Fabric partial_fabric(const FabricHeader& header, int first, int last) {
  Fabric fabric{header, {}, {}};
  if (first == 0 && last == header.levels - 1) return fabric;
  const bool unknown = header.whole && header.whole->levels == 0 && last == header.levels - 1;
  fabric.whole =
      WholeFabric{whole_texels(header), header.first_level() + first, unknown ? 0 : whole_levels(header)};
  return fabric;
}

}  // namespace selvedge
