// Inner products of many long columns, and their triangular factor.
#pragma once

#include <vector>

#include "fitter/texel_samples.h"

namespace selvedge {

/// Columns of equal length, a multiple of TexelSamples::lanes.
using Columns = std::vector<std::vector<float>>;

/// gram[a * columns + b] = sum over rows of a * b, for all pairs. Summed in single precision over short
/// blocks and in double precision over the blocks, in an order that does not depend on the processor's vector
/// width.
void inner_products(const Columns& columns, std::vector<double>& gram);

/// The same for one column with itself.
double squared_norm(const std::vector<float>& column);

/// Upper triangular R with R^T R = gram, in place (row-major, zeros below the diagonal). A column that
/// depends on those before it, within rounding, gets a zero pivot and a zero row. Precondition: gram is
/// positive semidefinite.
void cholesky(std::vector<double>& gram, std::size_t columns);

}  // namespace selvedge
