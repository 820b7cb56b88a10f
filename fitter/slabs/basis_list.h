// The functions that a fabric stores, each once, whichever levels use it.
#pragma once

#include <vector>

#include "fitter/slabs/shared_basis.h"
#include "format/fabric/fabric.h"

namespace selvedge {

class FunctionList {
 public:
  /// Numbers of a product's functions in the list, added where they are new; the constant function of the
  /// view is 0. `pair`: of `products`.
  V2i add(const Products& products, const V2i& pair);
  /// In the file, estimated.
  double bytes() const;
  ProductBases bases() const;

 private:
  std::vector<std::vector<float>> view_;
  std::vector<std::vector<float>> light_;
};

}  // namespace selvedge
