// Levels of products alone. Their F is linear in the coefficients, so the coefficients of all texels under a
// pixel are averaged first and F is evaluated once; negative F counts as 0 only then.
#pragma once

#include <cstdint>

#include "viewer/hybrid/lane_lookups.h"

namespace selvedge {

/// Adds the texels of `lanes`, whose levels have the layout, and their opacity to `alpha`.
void add_texels(const PackedFabric& fabric, const LaneTexels& texels, std::uint32_t lanes,
                const AllLookups& lookups, const MeanProducts& mean, LaneFloats& alpha);

/// Adds the light of the sums to `result`, also from all `around` if that is not null. `of_lights`: memory,
/// [b][lane].
void shine(const SharedInputs& s, const MeanProducts& mean, const LaneSmoothLight* around, float* of_lights,
           LaneShading& result);

}  // namespace selvedge
