// Fits of samples by few coefficients per texel of products of shared functions: f(l, v) = l_z sum_ab
// G_ab phi_a(v) psi_b(l), a truncated higher-order singular value decomposition of the samples of all levels.
#pragma once

#include <vector>

#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// Shared functions, and coefficients of their products for every texel.
struct BasisFit {
  std::vector<std::vector<float>> view_functions;  ///< phi_a, [a][view], mean square 1
  std::vector<std::vector<float>>
      light_functions;             ///< psi_b, [b][3 * light + channel]; l_z psi_b is about unit
  std::vector<V2i> pairs;          ///< (a, b) of product m
  std::vector<float> coefficient;  ///< [texel * pairs.size() + m]
  std::size_t texel_count() const { return pairs.empty() ? 0 : coefficient.size() / pairs.size(); }
};

/// The best `max_view` x `max_light` separable functions for all levels together (a
/// level's weight is the square root of its texels), then least squares per texel, with samples weighted by
/// alpha squared, because pictures show alpha f. `lights`: the grid of the samples.
std::vector<BasisFit> texel_basis(const std::vector<SampleLevel>& levels, const DirectionGrid& lights,
                                  std::size_t max_view, std::size_t max_light);

/// Multiplies the functions of the light of every fit by a factor for each colour channel.
void scale_light(std::vector<BasisFit>& fits, const V3d& factor);

/// Root mean square of the coefficients of the strongest product, over texels that use it.
float coefficient_scale(const BasisFit& basis);

}  // namespace selvedge
