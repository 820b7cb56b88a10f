// The middle of some figures.
#pragma once

#include <algorithm>
#include <vector>

namespace selvedge {

/// The middle one; of an even number the lower of the two. Precondition: there is one.
inline double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[(values.size() - 1) / 2];
}

}  // namespace selvedge
