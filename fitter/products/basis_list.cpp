#include "fitter/products/basis_list.h"

#include <algorithm>

#include "fitter/products/coded_size.h"

namespace selvedge {
namespace {

int index_in(std::vector<std::vector<float>>& list, const std::vector<float>& function) {
  const auto found = std::ranges::find(list, function);
  const auto index = static_cast<int>(found - list.begin());
  if (found == list.end()) list.push_back(function);
  return index;
}

}  // namespace

V2i BasisList::add(const BasisFit& basis, const V2i& pair) {
  const std::vector<float>& phi = basis.view[pair.x];
  const bool constant = std::ranges::all_of(phi, [](float value) { return value == 1; });
  const int a = constant ? 0 : index_in(view_, phi) + 1;
  return {a, index_in(light_, basis.light[pair.y])};
}

double BasisList::bytes() const {
  std::vector<float> values;
  for (const auto* list : {&view_, &light_}) {
    for (const auto& function : *list) values.insert(values.end(), function.begin(), function.end());
  }
  return coded_bytes(values, 1, 32);
}

ProductBases BasisList::bases() const {
  ProductBases result;
  for (const auto& function : view_) result.view.insert(result.view.end(), function.begin(), function.end());
  for (const auto& function : light_) {
    for (std::size_t i = 0; i + 2 < function.size(); i += 3) {
      result.light.emplace_back(function[i], function[i + 1], function[i + 2]);
    }
  }
  return result;
}

}  // namespace selvedge
