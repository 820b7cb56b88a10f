// Coefficients as whole numbers of a step, chosen for their bytes and for the error that texels show.
//
// ZIP codes the difference of a value from its left neighbour, so a number costs the information of that
// difference; along a row of texels the cheapest sequence is found by Viterbi's algorithm. A texel shows the
// mean over several entries: the error of one of them is made good by its neighbours, whose numbers are
// chosen against the error that all of them show together. The errors that remain are those that do not show.
#pragma once

#include <cstdint>
#include <vector>

#include "fitter/slabs/shared_basis.h"
#include "fitter/slabs/slab_tables.h"

namespace selvedge {

/// How much texels show of two entries at once: the normal equations of slabs with one function of the view.
struct SlabOverlaps {
  std::vector<std::size_t> first;    ///< of each entry in `other` and `shared`, then the end
  std::vector<std::uint32_t> other;  ///< entries, not itself
  std::vector<float> shared;         ///< sum over texels and views of the product of the shares of the rays
  std::vector<float> own;            ///< [entry]: of itself; 0: never seen
};

SlabOverlaps overlaps_of(const SlabRays& rays, std::size_t entries);

struct Quantisation {
  float step = 1;
  /// Pairs of functions are left out if their coefficients have a root mean square below so many steps.
  float least = 0;
  /// Price of a bit: squared steps of error in an entry that is seen as much as the mean. 0: rounding.
  float price = 0;
  std::size_t width = 1;    ///< texels of a row
  std::size_t entries = 1;  ///< of a texel
};

/// How many pairs of functions quantised() keeps.
std::size_t pairs_kept(const BasisFit& basis, const Quantisation& how);

/// `overlaps`: of the entries that own the coefficients; null: owners are seen one by one, all alike.
/// Deterministic for any number of threads.
BasisFit quantised(const BasisFit& basis, const Quantisation& how, const SlabOverlaps* overlaps);

}  // namespace selvedge
