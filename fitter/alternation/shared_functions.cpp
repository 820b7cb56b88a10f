#include "fitter/alternation/shared_functions.h"

namespace selvedge {
namespace {

std::size_t padded(std::size_t count) { return (count + column_group - 1) / column_group * column_group; }

std::vector<double> gram_of(const std::vector<std::vector<double>>& functions, std::size_t first,
                            std::size_t step) {
  std::vector<double> gram;
  for (const auto& a : functions) {
    for (const auto& b : functions) {
      double sum = 0;
      for (std::size_t i = first; i < a.size(); i += step) sum += a[i] * b[i];
      gram.push_back(sum);
    }
  }
  return gram;
}

}  // namespace

PreparedFunctions::PreparedFunctions(const SharedFunctions& functions, std::size_t stride)
    : count_(functions.count()),
      pair_width_(padded(count_ * (count_ + 1) / 2)),
      view_rows_(count_ * stride),
      views_(stride * column_group),
      view_pairs_(stride * pair_width_),
      view_gram_(gram_of(functions.view, 0, 1)) {
  const auto lay_out = [&](std::size_t row, const auto& value, std::vector<float>& each,
                           std::vector<float>& pairs) {
    for (std::size_t m = 0; m < count_; ++m) {
      each[row * column_group + m] = static_cast<float>(value(m));
      for (std::size_t n = 0; n <= m; ++n) {
        pairs[row * pair_width_ + pair(m, n)] = static_cast<float>(value(m) * value(n));
      }
    }
  };
  for (std::size_t v = 0; v < functions.view.front().size(); ++v) {
    lay_out(
        v, [&](std::size_t m) { return functions.view[m][v]; }, views_, view_pairs_);
    for (std::size_t m = 0; m < count_; ++m)
      view_rows_[m * stride + v] = static_cast<float>(functions.view[m][v]);
  }
  const std::size_t lights = functions.light.front().size() / 3;
  for (std::size_t c = 0; c < 3; ++c) {
    lights_[c].resize(lights * column_group);
    light_pairs_[c].resize(lights * pair_width_);
    light_gram_[c] = gram_of(functions.light, c, 3);
    for (std::size_t l = 0; l < lights; ++l) {
      lay_out(
          l, [&](std::size_t m) { return functions.light[m][3 * l + c]; }, lights_[c], light_pairs_[c]);
    }
  }
}

FunctionSums::FunctionSums(Side of, std::size_t row_count, std::size_t product_count)
    : side(of), rows(row_count), count(product_count) {
  const std::size_t pairs = count * (count + 1) / 2;
  square.resize(rows * pairs);
  cross.resize(rows * count);
  for (auto& channel : pulled) channel.resize(pairs);
}

void FunctionSums::add(const FunctionSums& other) {
  const auto join = [](std::vector<double>& to, const std::vector<double>& more) {
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += more[i];
  };
  join(square, other.square);
  join(cross, other.cross);
  for (std::size_t c = 0; c < 3; ++c) join(pulled[c], other.pulled[c]);
}

}  // namespace selvedge
