// The radiance scale of a fabric, which keeps the values of its layers within half precision for samples of
// any brightness.
#pragma once

#include "format/fabric/fabric.h"

namespace selvedge {

/// The power of two by which samples are divided before they are squared and summed in single precision, and
/// lobes before they are stored: the nearest to `largest`, or 1 if that is between 2^-8 and 2^12, or 0, or
/// not finite.
double choose_radiance_scale(double largest);

/// Sets the scale by the largest rho or peak of a lobe, and divides rho, lobes and products without lobes by
/// it. f changes only by the rounding of cx, cy and cz. Preconditions: the scale is 1, no exponent is
/// below 1.
void set_radiance_scale(Fabric& fabric);

/// Multiplies rho, cx, cy and cz by the scale, which becomes 1. Precondition: no level has products.
void remove_radiance_scale(Fabric& fabric);

}  // namespace selvedge
