// The lobes of a channel for every view of a texel.
#pragma once

#include <span>

#include "fitter/lobes/lobe_moments.h"
#include "fitter/solve/texel_samples.h"

namespace selvedge {

/// rho + sum_j size_j max(0, d_j . (l * v))^n_j for light `index` of samples.lights and every view: `to` is
/// [samples.stride()]. `sizes`: rho first. The same bits on every machine.
void lobe_values(const TexelSamples& samples, std::uint32_t index, std::span<const LobeShape> shapes,
                 std::span<const double> sizes, float* to);

}  // namespace selvedge
