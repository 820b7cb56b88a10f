#include "converter/presets/presets.h"

#include <algorithm>

namespace selvedge {

std::optional<Quality> quality_named(std::string_view name) {
  const auto at = std::find(quality_names.begin(), quality_names.end(), name);
  if (at == quality_names.end()) return std::nullopt;
  return static_cast<Quality>(at - quality_names.begin());
}

TradePoint point_of(Quality quality) {
  TradePoint point;
  switch (quality) {
    case Quality::draft:
      point.texels = 8;
      point.views = point.lights = 36;
      point.samples = 2;
      point.lobes = 1;
      point.storage = Storage::half;
      break;
    case Quality::standard:
      point.texels = 16;
      point.samples = 2;
      point.layers = LayerChoice::products;
      point.budget = 32768;
      break;
    case Quality::high:
      point.samples = 2;
      point.layers = LayerChoice::slabs;
      point.budget = 131072;
      break;
    case Quality::reference:
      point.layers = LayerChoice::slabs;
      point.budget = 524288;
      break;
  }
  return point;
}

}  // namespace selvedge
