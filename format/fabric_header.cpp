#include "format/fabric_header.h"

#include <algorithm>

namespace selvedge {

int entry_of(const std::optional<LayerHeader>& layer, int level) {
  if (!layer) return -1;
  const auto found = std::find(layer->levels.begin(), layer->levels.end(), level);
  return found == layer->levels.end() ? -1 : static_cast<int>(found - layer->levels.begin());
}

V2i whole_texels(const FabricHeader& header) {
  return header.whole ? header.whole->texels : V2i(header.width, header.height);
}

int first_level(const FabricHeader& header) { return header.whole ? header.whole->level : 0; }

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

Fabric without_levels(const FabricHeader& header) {
  Fabric fabric;
  fabric.period_mm = header.period_mm;
  fabric.reference_height = header.reference_height;
  fabric.thickness_mm = header.thickness_mm;
  fabric.radiance_scale = header.radiance_scale;
  fabric.views = header.views;
  fabric.lights = header.lights;
  fabric.provenance = header.provenance;
  fabric.whole = header.whole;
  return fabric;
}

}  // namespace selvedge
