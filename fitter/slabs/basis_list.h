// The functions that a fabric stores: each once, whichever levels use it.
#pragma once

#include <vector>

#include "fitter/slabs/shared_basis.h"
#include "format/fabric/fabric.h"

namespace selvedge {

class BasisList {
 public:
  /// Numbers of the functions of a pair of `basis` in the list, added where they are new; the constant
  /// function of the view is 0.
  V2i add(const BasisFit& basis, const V2i& pair);
  /// An estimate of the bytes in the file.
  double bytes() const;
  ProductBases bases() const;

 private:
  std::vector<std::vector<float>> view_;
  std::vector<std::vector<float>> light_;
};

}  // namespace selvedge
