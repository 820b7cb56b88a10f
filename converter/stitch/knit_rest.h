// Brings a drawn knit to rest (knit_cloth.h): relax() of a knit.
//
// A loop keeps the length that the table gives it. Plain knit of the same yarn is laid at the gauge first:
// the bends of its loops are in part set, as knitted yarn's are, and its free size says how cloth that is
// left to itself lies beside cloth of the gauge.
#pragma once

#include "converter/stitch/yarn_relax.h"

namespace selvedge {

/// Precondition: RelaxOptions::parts of draw_knit(), and its pattern.
RelaxResult rest_knit(const StitchPattern& drawn, const RelaxOptions& options);

}  // namespace selvedge
