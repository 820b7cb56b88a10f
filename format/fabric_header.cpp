#include "format/fabric_header.h"

#include <algorithm>

namespace selvedge {

int entry_of(const std::optional<LayerHeader>& layer, int level) {
  if (!layer) return -1;
  const auto found = std::find(layer->levels.begin(), layer->levels.end(), level);
  return found == layer->levels.end() ? -1 : static_cast<int>(found - layer->levels.begin());
}

Fabric without_levels(const FabricHeader& header) {
  Fabric fabric;
  fabric.period_mm = header.period_mm;
  fabric.reference_height = header.reference_height;
  fabric.thickness_mm = header.thickness_mm;
  fabric.views = header.views;
  fabric.provenance = header.provenance;
  return fabric;
}

}  // namespace selvedge
