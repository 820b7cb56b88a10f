#include "fitter/solve/small_solve.h"

#include <cmath>

namespace selvedge {

bool solve_symmetric(std::vector<double>& matrix, std::vector<double>& b, const std::vector<char>& fixed) {
  const std::size_t n = b.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (!fixed[i]) continue;
    for (std::size_t j = 0; j < n; ++j) matrix[i * n + j] = matrix[j * n + i] = 0;
    matrix[i * n + i] = 1;
    b[i] = 0;
  }
  for (std::size_t i = 0; i < n; ++i) {
    double* row = &matrix[i * n];
    for (std::size_t j = 0; j <= i; ++j) {
      const double* other = &matrix[j * n];
      double sum = row[j];
      for (std::size_t k = 0; k < j; ++k) sum -= row[k] * other[k];
      if (i > j) {
        row[j] = sum / other[j];
        continue;
      }
      if (!(sum > 0)) return false;
      row[i] = std::sqrt(sum);
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= matrix[i * n + k] * b[k];
    b[i] /= matrix[i * n + i];
  }
  for (std::size_t i = n; i-- > 0;) {
    b[i] /= matrix[i * n + i];
    for (std::size_t k = 0; k < i; ++k) b[k] -= matrix[i * n + k] * b[i];
  }
  return true;
}

}  // namespace selvedge
