// The scale of a fabric's radiance: what keeps the numbers of layers within half precision, however bright or
// dark the samples were.
#pragma once

#include "format/fabric.h"

namespace selvedge {

/// Where the largest rho or lobe's peak is below 2^-8 or above 2^12, gives the
/// fabric the power of two nearest to it as its scale and divides rho and lobes by it. f stays
/// the same but for the rounding of cx, cy and cz. Preconditions: the scale is 1, no exponent is below 1, no
/// level has products.
void set_radiance_scale(Fabric& fabric);

}  // namespace selvedge
