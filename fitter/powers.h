// Powers of many bases with one exponent: where a fit's time goes.
#pragma once

#include <cstddef>

namespace selvedge {

/// logarithm[i] = ln(base[i]) and power[i] = base[i]^exponent in single precision; both 0 where the base is
/// not above 1e-30. exponent in [0, 1000]; powers outside of 2^-126 .. 2^127 are held at those. Relative
/// error of the power below 1e-6 + 4e-7 * exponent * |ln(base)| (the rounding of three products). Every
/// element is computed by the same IEEE operations whatever the processor's vector width: the same bits
/// everywhere.
void powers(const float* base, float exponent, float* logarithm, float* power, std::size_t count);

}  // namespace selvedge
