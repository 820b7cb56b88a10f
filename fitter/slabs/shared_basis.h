// Fits of samples, or of tables of slabs, by few coefficients per texel of products of shared functions.
//
// The functions of the light are principal components of the texels' radiance; at levels without slabs
// so are those of the view: f(l, v) = sum_ab G_ab phi_a(v) psi_b(l) is a truncated higher-order singular
// value decomposition of the samples.
#pragma once

#include <vector>

#include "fitter/slabs/slab_tables.h"
#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// Shared functions, and coefficients of their products for every owner: a texel, or an entry of slabs.
struct BasisFit {
  std::vector<std::vector<float>> view;   ///< phi_a, [a][view], mean square 1; the first may be constant
  std::vector<std::vector<float>> light;  ///< psi_b, [b][3 * light + channel], unit
  std::vector<V2i> pairs;                 ///< (a, b) of product m
  std::vector<float> coefficient;         ///< [owner * pairs.size() + m]
  std::size_t owners() const { return pairs.empty() ? 0 : coefficient.size() / pairs.size(); }
};

/// For levels with slabs: every phi_a has its own functions of the light, at most `max_functions` for phi_0
/// and a quarter as many for the others. One result per level, with the same functions and pairs.
/// `view_functions`: those that the tables were fitted with. `unit`, [3 * light + channel]: tables were
/// fitted in the inverse of these units, by which the returned functions are divided; null: 1.
std::vector<BasisFit> slab_basis(const std::vector<SlabTables>& levels,
                                 const std::vector<std::vector<float>>& view_functions,
                                 std::size_t max_functions, const std::vector<float>* unit = nullptr);

/// For levels without slabs: the best `max_view` x `max_light` separable functions for all levels together (a
/// level's weight is the square root of its texels), then least squares per texel, with samples weighted by
/// alpha squared, because pictures show alpha f.
std::vector<BasisFit> texel_basis(const std::vector<SampleLevel>& levels, std::size_t max_view,
                                  std::size_t max_light);

/// Root mean square of the coefficients of the strongest product, over owners that use it.
float coefficient_scale(const BasisFit& basis);

}  // namespace selvedge
