// Bake options and mip levels that cover exactly what a plan needs (docs/plan.md).
#pragma once

#include "converter/bake/bake.h"
#include "format/scene/level_bounds.h"

namespace selvedge {

/// Options of the smallest bake that satisfies `demand`. If the demand does not need the finest level
/// (whole.width x whole.height texels), the texels are coarser: level L has 4^(L - 1) times the samples of a
/// texel, a quarter of the rays of the whole bake, and 2^(L - 1) times the truth samples. Pairs that no fit
/// uses are left out; `chooses` says whether the fit selects layers by the validation pairs.
BakeOptions bake_for(const TexelDemand& demand, const V2d& period_mm, BakeOptions whole, bool chooses);

/// The number of levels of the partial fabric that the demand needs, where `header` is that of its samples.
int levels_needed(const TexelDemand& demand, const SamplesHeader& header);

}  // namespace selvedge
