#include "converter/bake/for_plan.h"

#include <algorithm>
#include <cmath>

namespace selvedge {

BakeOptions bake_for(const TexelDemand& demand, const V2d& period_mm, BakeOptions whole, bool chooses) {
  const V2d texel_mm(period_mm.x / whole.width, period_mm.y / whole.height);
  const int level = levels_for(demand, texel_mm, level_count(whole.width, whole.height)).first;
  if (!whole.pairs) {
    whole.rim_pairs = 0;
    if (!chooses) whole.validation_pairs = 0;
  }
  if (level == 0) return whole;
  whole.whole = WholeFabric{V2i(whole.width, whole.height), level};
  whole.width = level_size(whole.width, level);
  whole.height = level_size(whole.height, level);
  // Each level has four texels for one of the next.
  constexpr double max_samples = 65536;
  const double factor = std::exp2(2.0 * (level - 1));
  whole.samples = static_cast<int>(std::min(whole.samples * factor, max_samples));
  whole.truth_samples = static_cast<int>(std::min(whole.truth_samples * std::sqrt(factor), max_samples));
  return whole;
}

int levels_needed(const TexelDemand& demand, const SamplesHeader& header) {
  const WholeFabric whole = header.whole.value_or(WholeFabric{V2i(header.width, header.height), 0});
  const V2d texel_mm(static_cast<double>(header.period_mm.x) / whole.texels.x,
                     static_cast<double>(header.period_mm.y) / whole.texels.y);
  const int all = level_count(whole.texels.x, whole.texels.y);
  return std::max(levels_for(demand, texel_mm, all).last - whole.level + 1, 1);
}

}  // namespace selvedge
