// Quantisation of coefficients to multiples of a step, by the rate in the file and the distortion of texels.
//
// ZIP codes the difference of a value from its left neighbour, so the rate of a number is the information of
// this difference; Viterbi's algorithm finds the best sequence along a row of texels.
#pragma once

#include "fitter/products/texel_basis.h"

namespace selvedge {

struct Quantisation {
  float step = 1;
  /// Pairs of functions are dropped if the root mean square of their coefficients is below this many steps.
  float min_rms = 0;
  /// Cost of a bit, in squared steps of error. 0: plain rounding.
  float bit_cost = 0;
  std::size_t row_texels = 1;  ///< texels of a row
};

/// Number of pairs of functions that quantise() keeps.
std::size_t kept_pair_count(const BasisFit& basis, const Quantisation& options);

/// Does not depend on the number of threads.
BasisFit quantise(const BasisFit& basis, const Quantisation& options);

/// Bytes of `values` ([texel][channel], rows of `width` texels) in half precision, in the writer's
/// tiles and ZIP, without the headers of chunks.
double coded_bytes(const std::vector<float>& values, std::size_t channels, std::size_t width);

}  // namespace selvedge
