// The scale of a fabric's radiance. It keeps the numbers of layers within half precision, however bright or
// dark the samples were.
#pragma once

#include "format/fabric/fabric.h"

namespace selvedge {

/// A power of two by which samples are divided before they are squared and summed in single precision, and
/// lobes before they are stored: the one nearest to the largest of them, or 1 where that is between 2^-8 and
/// 2^12, or 0, or not finite.
double scale_for(double largest);

/// Gives the fabric scale_for() its largest rho or lobe's peak as its scale, and divides rho, lobes and
/// products without lobes by it. f stays the same but for the rounding of cx, cy and cz. Preconditions: the
/// scale is 1, no exponent is below 1.
void set_radiance_scale(Fabric& fabric);

/// The inverse: the scale goes back into rho, cx, cy and cz, and is 1 again. Precondition: no level has
/// products.
void remove_radiance_scale(Fabric& fabric);

}  // namespace selvedge
