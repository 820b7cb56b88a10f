// BasisFit of shared functions: a level's samples, or its slabs' tables, as few coefficients per texel.
//
// The functions of the light are principal components of the texels' radiance; at levels without slabs
// those of the view are too, so that f(l, v) = sum_ab G_ab phi_a(v) psi_b(l) is the texel's table of all
// samples in a separable basis (a truncated higher-order singular value decomposition).
#pragma once

#include <vector>

#include "fitter/slabs/slab_tables.h"
#include "format/fabric/fabric.h"
#include "format/samples/samples.h"

namespace selvedge {

/// The functions of a basis and, for every texel or entry (its owner), the coefficients of their products.
struct BasisFit {
  std::vector<std::vector<float>> view;   ///< phi_a, [a][view], mean square 1; the first may be constant
  std::vector<std::vector<float>> light;  ///< psi_b, [b][3 * light + channel], unit
  std::vector<V2i> pairs;                 ///< (a, b) of product m
  std::vector<float> coefficient;         ///< [owner * pairs.size() + m]
  std::size_t owners() const { return pairs.empty() ? 0 : coefficient.size() / pairs.size(); }
};

/// Slabs of some levels: every phi_a has functions of the light of its own, at most `most` for phi_0 and a
/// quarter as many for each other. One result per level, with the same functions and pairs. `view_functions`
/// are those the tables were fitted with. `unit`, [3 * light + channel]: tables are in the inverse of it, and
/// so are the functions that are given back in it.
std::vector<BasisFit> slab_basis(const std::vector<SlabTables>& levels,
                                 const std::vector<std::vector<float>>& view_functions, std::size_t most,
                                 const std::vector<float>* unit = nullptr);

/// Levels without slabs: the best `max_view` x `max_light` separable functions for all of them (each level
/// counts by the square root of its texels), then every texel's least squares with the samples weighted by
/// alpha squared, because alpha f is seen.
std::vector<BasisFit> texel_basis(const std::vector<SampleLevel>& levels, std::size_t max_view,
                                  std::size_t max_light);

/// Root mean square of the coefficients of the strongest product.
float scale_of(const BasisFit& basis);

}  // namespace selvedge
