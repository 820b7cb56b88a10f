// Sums over the views, light by light, for the least squares of a table over lights.
#pragma once

#include <span>
#include <vector>

#include "fitter/lobes/lobe_moments.h"
#include "fitter/solve/texel_samples.h"

namespace selvedge {

/// Sums for all lights, 0 for lights below the horizon; g = T(v) l_z (rho + sum_j size_j base_j^n_j).
struct LightSums {
  std::vector<double> square;  ///< sum over views of w g^2
  std::vector<double> cross;   ///< sum over views of w g r
};

/// `sizes`: rho first. `table`: [view].
LightSums light_sums(const TexelSamples& samples, int channel, std::span<const LobeShape> shapes,
                     std::span<const double> sizes, std::span<const double> table);

}  // namespace selvedge
