#include "fitter/alternation/sums.h"

#include <array>

#include "format/simd/powers.h"

namespace selvedge {
namespace {

/// `Rows` rows and `Count` columns, whose sums stay in registers.
template <std::size_t Count, std::size_t Rows>
SELVEDGE_INLINE void add_tile(const PairWeights& weights, std::size_t row, const std::uint32_t* index,
                              const float* columns, std::size_t width, float* to) {
  using L = Lanes<Count>;
  std::array<typename L::Floats, Rows> sum{};
  for (std::size_t i = 0; i < weights.inner; ++i) {
    typename L::Floats column;
    L::load(columns + (index != nullptr ? index[i] : i) * width, column);
    const float* w = weights.value + row * weights.row_step + i * weights.inner_step;
    for (std::size_t r = 0; r < Rows; ++r) sum[r] += w[r * weights.row_step] * column;
  }
  for (std::size_t r = 0; r < Rows; ++r) L::store(sum[r], to + (row + r) * width);
}

template <std::size_t Count>
SELVEDGE_INLINE void add_all(const PairWeights& weights, const std::uint32_t* index, const float* columns,
                             std::size_t width, float* to) {
  constexpr std::size_t together = 8;
  for (std::size_t first = 0; first < width; first += Count) {
    std::size_t row = 0;
    for (; row + together <= weights.rows; row += together) {
      add_tile<Count, together>(weights, row, index, columns + first, width, to + first);
    }
    for (; row < weights.rows; ++row) {
      add_tile<Count, 1>(weights, row, index, columns + first, width, to + first);
    }
  }
}

SELVEDGE_THREE_BODIES(add_all,
                      (const PairWeights& weights, const std::uint32_t* index, const float* columns,
                       std::size_t width, float* to),
                      (weights, index, columns, width, to))

}  // namespace

void weighted_sums(const PairWeights& weights, const std::uint32_t* index, const float* columns,
                   std::size_t width, float* to) {
  static const auto body = add_all_for_this_processor();
  body(weights, index, columns, width, to);
}

SELVEDGE_WIDE
void combine_rows(const float* base, float factor, const float* c, std::size_t count, const float* rows,
                  std::size_t stride, float* to) {
  for (std::size_t v = 0; v < stride; ++v) to[v] = base[v] * factor;
  for (std::size_t m = 0; m < count; ++m) {
    const float* row = rows + m * stride;
    for (std::size_t v = 0; v < stride; ++v) to[v] += c[m] * row[v];
  }
}

SELVEDGE_WIDE
void weigh_row(const float* w, const float* g, const float* r, const float* f, std::size_t count,
               float* square, float* cross) {
  for (std::size_t v = 0; v < count; ++v) {
    const float wg = w[v] * g[v];
    square[v] = wg * g[v];
    cross[v] = wg * (r[v] - g[v] * f[v]);
  }
}

SELVEDGE_WIDE
double squared_error(const float* w, const float* g, const float* r, const float* f, std::size_t count) {
  constexpr std::size_t parts = 8;
  std::array<double, parts> sum{};
  for (std::size_t v = 0; v < count; v += parts) {
    for (std::size_t k = 0; k < parts; ++k) {
      const float difference = g[v + k] * f[v + k] - r[v + k];
      sum[k] += static_cast<double>(w[v + k] * difference * difference);
    }
  }
  return ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
}

}  // namespace selvedge
