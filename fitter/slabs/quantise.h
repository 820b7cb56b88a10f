// Quantisation of coefficients to multiples of a step, by the rate in the file and the distortion of texels.
//
// ZIP codes the difference of a value from its left neighbour, so the rate of a number is the information of
// this difference; Viterbi's algorithm finds the best sequence along a row of texels. As a texel shows the
// mean over several entries, the numbers of an entry are chosen to compensate the errors of the entries that
// are seen together with it.
#pragma once

#include <cstdint>
#include <vector>

#include "fitter/slabs/shared_basis.h"
#include "fitter/slabs/slab_tables.h"

namespace selvedge {

/// Sums over texels and views of products of two entries' shares of the rays: the sparse normal equations of
/// slabs with one function of the view.
struct SlabOverlaps {
  std::vector<std::size_t> first;    ///< [entry]: its first index in `other` and `shared`; then the end
  std::vector<std::uint32_t> other;  ///< the entries seen together with it
  std::vector<float> shared;         ///< sum for the entry and the other one
  std::vector<float> own;            ///< [entry]: sum of its squared shares; 0: never seen
};

SlabOverlaps overlaps_of(const SlabRays& rays, std::size_t entries);

struct Quantisation {
  float step = 1;
  /// Pairs of functions are dropped if the root mean square of their coefficients is below so many steps.
  float min_rms = 0;
  /// Cost of a bit, in squared steps of error of an entry of mean visibility. 0: plain rounding.
  float price = 0;
  std::size_t width = 1;    ///< texels of a row
  std::size_t entries = 1;  ///< of a texel
};

/// Number of pairs of functions that quantise() keeps.
std::size_t kept_pair_count(const BasisFit& basis, const Quantisation& options);

/// `overlaps`: of the entries that own the coefficients; null: every owner is seen alone, all with the same
/// weight. Does not depend on the number of threads.
BasisFit quantise(const BasisFit& basis, const Quantisation& options, const SlabOverlaps* overlaps);

}  // namespace selvedge
