// The list of shared functions that a fabric stores, without duplicates.
#pragma once

#include <vector>

#include "fitter/products/texel_basis.h"
#include "format/fabric/fabric.h"

namespace selvedge {

class BasisList {
 public:
  /// Indices in the list of the functions of a pair of `basis`, which are added if they are new; the constant
  /// function of the view has index 0.
  V2i add(const BasisFit& basis, const V2i& pair);
  /// Estimated size in the file.
  double bytes() const;
  ProductBases bases() const;

 private:
  std::vector<std::vector<float>> view_;
  std::vector<std::vector<float>> light_;
};

}  // namespace selvedge
