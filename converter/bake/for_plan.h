// The bake and the levels that a plan needs, and no more (docs/plan.md).
#pragma once

#include "converter/bake/bake.h"
#include "format/scene/level_bounds.h"

namespace selvedge {

/// The bake of no more than the demand needs of a cell: coarser texels, where the finest level is one of
/// whole.width x whole.height texels that it does not need. Level L has 4^(L - 1) times the samples of
/// a texel, a quarter of the rays of the whole bake, and 2^(L - 1) times the truth samples. Pairs that no fit
/// looks at are left out; `chooses`: the fit chooses by the validation pairs.
BakeOptions bake_for(const TexelDemand& demand, const V2d& period_mm, BakeOptions whole, bool chooses);

/// Levels of the partial fabric that the demand needs, of texels as `header` has them.
int levels_needed(const TexelDemand& demand, const SamplesHeader& header);

}  // namespace selvedge
