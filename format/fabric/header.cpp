#include "format/fabric/header.h"

#include <fmt/format.h>

#include <algorithm>

namespace selvedge {
namespace {

std::string model_of(const Fabric& fabric) {
  const FabricLevel& base = fabric.levels.front();
  std::string model = base.lobes ? "lafortune" : "constant";
  if (base.view_table) model += "-view-table";
  if (base.light_table) model += "-light-table";
  if (base.products) model += "-products";
  if (base.heights) model += "-slabs";
  return model;
}

}  // namespace

FabricHeader header_of(const Fabric& fabric) {
  FabricHeader header;
  header.model = model_of(fabric);
  header.width = fabric.levels.front().width;
  header.height = fabric.levels.front().height;
  header.levels = static_cast<int>(fabric.levels.size());
  header.period_mm = fabric.period_mm;
  header.reference_height = fabric.reference_height;
  header.thickness_mm = fabric.thickness_mm;
  header.radiance_scale = fabric.radiance_scale;
  header.views = fabric.views;
  header.lights = fabric.lights;
  header.provenance = fabric.provenance;
  header.whole = fabric.whole;
  return header;
}

int entry_of(const std::optional<LayerHeader>& layer, int level) {
  if (!layer) return -1;
  const auto found = std::find(layer->levels.begin(), layer->levels.end(), level);
  return found == layer->levels.end() ? -1 : static_cast<int>(found - layer->levels.begin());
}

V2i whole_texels(const FabricHeader& header) {
  return header.whole ? header.whole->texels : V2i(header.width, header.height);
}

int first_level(const FabricHeader& header) { return header.whole ? header.whole->level : 0; }

int whole_levels(const FabricHeader& header) {
  return std::max(header.whole ? header.whole->levels : 0, first_level(header) + header.levels);
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
  const int first = first_level(header);
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

LayerShape shape_of(const FabricHeader& header) {
  LayerShape shape;
  shape.views = header.views.count();
  shape.lights = header.lights.count();
  shape.base_texels = header.width * header.height;
  if (const auto& lobes = header.layer(Layer::lobes)) shape.lobes = lobes->lobes;
  if (const auto& heights = header.layer(Layer::heights)) shape.cells = heights->cells;
  if (const auto& bases = header.layer(Layer::bases)) {
    shape.view_functions = bases->view_functions;
    shape.light_functions = bases->light_functions;
  }
  if (const auto& products = header.layer(Layer::products)) {
    for (std::size_t i = 0; i < products->levels.size(); ++i) {
      const int entries = entries_at(header, products->levels[i]);
      shape.products = std::max(shape.products, entries * static_cast<int>(products->pairs[i].size()));
    }
  }
  return shape;
}

int entries_at(const FabricHeader& header, int level) {
  const auto& heights = header.layer(Layer::heights);
  return entry_of(heights, level) >= 0 ? heights->cells.entries() : 1;
}

Fabric fabric_from_header(const FabricHeader& header) {
  return fabric_from_header(header, 0, header.levels - 1);
}

Fabric fabric_from_header(const FabricHeader& header, int first, int last) {
  Fabric fabric;
  fabric.period_mm = header.period_mm;
  fabric.reference_height = header.reference_height;
  fabric.thickness_mm = header.thickness_mm;
  fabric.radiance_scale = header.radiance_scale;
  fabric.views = header.views;
  fabric.lights = header.lights;
  fabric.provenance = header.provenance;
  fabric.whole = header.whole;
  if (first == 0 && last == header.levels - 1) return fabric;
  const bool unknown = header.whole && header.whole->levels == 0 && last == header.levels - 1;
  fabric.whole =
      WholeFabric{whole_texels(header), first_level(header) + first, unknown ? 0 : whole_levels(header)};
  return fabric;
}

}  // namespace selvedge
