#include "fitter/gram.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace selvedge {
namespace {

constexpr std::size_t lanes = TexelSamples::lanes;
/// Rows whose sum is kept in single precision: 32 additions a lane lose at most 5 bits of 24.
constexpr std::size_t block = 32 * lanes;

float block_product(const float* a, const float* b, std::size_t rows) {
  std::array<float, lanes> sum{};
  for (std::size_t i = 0; i < rows; i += lanes) {
    for (std::size_t k = 0; k < lanes; ++k) sum[k] += a[i + k] * b[i + k];
  }
  return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

}  // namespace

void inner_products(const Columns& columns, std::vector<double>& gram) {
  const std::size_t count = columns.size();
  const std::size_t rows = columns.front().size();
  gram.assign(count * count, 0);
  // Block by block over all pairs: the block's rows stay in the first cache.
  for (std::size_t row = 0; row < rows; row += block) {
    const std::size_t length = std::min(block, rows - row);
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a; b < count; ++b) {
        gram[a * count + b] +=
            static_cast<double>(block_product(columns[a].data() + row, columns[b].data() + row, length));
      }
    }
  }
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = 0; b < a; ++b) gram[a * count + b] = gram[b * count + a];
  }
}

double squared_norm(const std::vector<float>& column) {
  double sum = 0;
  for (std::size_t row = 0; row < column.size(); row += block) {
    const std::size_t length = std::min(block, column.size() - row);
    sum += static_cast<double>(block_product(column.data() + row, column.data() + row, length));
  }
  return sum;
}

void cholesky(std::vector<double>& gram, std::size_t columns) {
  for (std::size_t k = 0; k < columns; ++k) {
    double* row = &gram[k * columns];
    double pivot = row[k];
    const double whole = pivot;
    for (std::size_t j = 0; j < k; ++j) pivot -= gram[j * columns + k] * gram[j * columns + k];
    std::fill(row, row + k, 0.0);
    // Single-precision sums know the pivot to about 1e-7 of the column's norm.
    if (!(pivot > 1e-9 * whole)) {
      std::fill(row + k, row + columns, 0.0);
      continue;
    }
    row[k] = std::sqrt(pivot);
    for (std::size_t b = k + 1; b < columns; ++b) {
      double value = row[b];
      for (std::size_t j = 0; j < k; ++j) value -= gram[j * columns + k] * gram[j * columns + b];
      row[b] = value / row[k];
    }
  }
}

}  // namespace selvedge
