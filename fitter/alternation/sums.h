// The loops over samples of a fit with products: sums over views or lights, in single precision a row at a
// time. The same bits on every processor.
#pragma once

#include <cstddef>
#include <cstdint>

namespace selvedge {

/// Columns of every matrix here come in groups of so many.
constexpr std::size_t column_group = 16;

/// Weights of pairs of directions, by rows and columns of the sum wanted:
/// weight(row, i) = value[row * row_step + i * inner_step].
struct PairWeights {
  const float* value = nullptr;
  std::size_t rows = 0;
  std::size_t row_step = 0;
  std::size_t inner = 0;
  std::size_t inner_step = 0;
};

/// to[row * width + j] = sum over i of weight(row, i) * columns[index(i) * width + j]; `index`: of each i, or
/// none: i itself. `width`: a multiple of column_group.
void weighted_sums(const PairWeights& weights, const std::uint32_t* index, const float* columns,
                   std::size_t width, float* to);

/// to = base * factor + sum over m of c[m] * rows[m * stride + v], for v below stride.
void combine_rows(const float* base, float factor, const float* c, std::size_t count, const float* rows,
                  std::size_t stride, float* to);

/// square = w g^2 and cross = w g (r - g f), v by v.
void weigh_row(const float* w, const float* g, const float* r, const float* f, std::size_t count,
               float* square, float* cross);

/// Sum of w (g f - r)^2.
double squared_error(const float* w, const float* g, const float* r, const float* f, std::size_t count);

}  // namespace selvedge
