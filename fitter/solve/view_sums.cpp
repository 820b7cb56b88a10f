#include "fitter/solve/view_sums.h"

#include <array>

#include "format/simd/wide.h"

namespace selvedge {

SELVEDGE_WIDE
double dot(const double* a, const double* b, std::size_t count) {
  std::array<double, 8> sum{};
  for (std::size_t i = 0; i < count; i += 8) {
    for (std::size_t k = 0; k < 8; ++k) sum[k] += a[i + k] * b[i + k];
  }
  return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

SELVEDGE_WIDE
void add_product(double* to, double c, const double* a, const double* b, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) to[i] += c * a[i] * b[i];
}

SELVEDGE_WIDE
void add_scaled(double* to, double c, const double* a, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) to[i] += c * a[i];
}

}  // namespace selvedge
