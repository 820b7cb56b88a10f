#include "fitter/products/quantise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "format/base/parallel.h"
#include "format/exr/exr.h"

namespace selvedge {
namespace {

/// Larger differences have the cost of this one.
constexpr int max_difference = 128;
/// Half precision holds multiples of a step exactly up to this.
constexpr float max_steps = 2048;
/// Numbers that are tried for a coefficient: those from the nearest towards 0, and one beyond.
constexpr int max_tried = 7;
constexpr int passes = 2;

/// The cost of differences: price times information, by their frequency in the previous pass.
class Costs {
 public:
  /// `numbers`: [texel * channels + channel].
  Costs(const std::vector<int>& numbers, std::size_t channels, std::size_t width, float price) {
    cost_.assign(2 * max_difference + 1, 0);
    std::vector<double> count(cost_.size(), 0.5);
    double all = 0.5 * static_cast<double>(count.size());
    for (std::size_t row = 0; row < numbers.size(); row += channels * width) {
      int before = 0;
      for (std::size_t channel = 0; channel < channels; ++channel) {
        for (std::size_t x = 0; x < width; ++x) {
          const int number = numbers[row + x * channels + channel];
          count[index(number - before)] += 1;
          all += 1;
          before = number;
        }
      }
    }
    for (std::size_t i = 0; i < count.size(); ++i)
      cost_[i] = price * static_cast<float>(std::log2(all / count[i]));
  }
  float operator()(int difference) const { return cost_[index(difference)]; }

 private:
  static std::size_t index(int difference) {
    return std::clamp(difference, -max_difference, max_difference) + max_difference;
  }
  std::vector<float> cost_;
};

/// Finds the numbers of a row with the smallest sum of rate and squared error; `values` are in steps.
void find_cheapest(const std::vector<float>& values, const Costs& costs, std::vector<int>& numbers) {
  struct Tried {
    int first = 0;
    int count = 0;
    std::array<std::uint8_t, max_tried> from{};
  };
  std::vector<Tried> tried(values.size());
  std::array<float, max_tried> cost{};
  int before = 0;
  int before_count = 1;
  for (std::size_t i = 0; i < values.size(); ++i) {
    Tried& here = tried[i];
    const int nearest = static_cast<int>(std::lround(std::clamp(values[i], -max_steps, max_steps)));
    here.first = std::min(nearest - 1, std::max(0, nearest - 3));
    here.count = std::max(nearest + 1, std::min(0, nearest + 3)) - here.first + 1;
    std::array<float, max_tried> next{};
    for (int k = 0; k < here.count; ++k) {
      const int number = here.first + k;
      float min_sum = std::numeric_limits<float>::infinity();
      for (int j = 0; j < before_count; ++j) {
        const float sum = cost[j] + costs(number - before - j);
        if (sum >= min_sum) continue;
        min_sum = sum;
        here.from[k] = static_cast<std::uint8_t>(j);
      }
      const float error = values[i] - static_cast<float>(number);
      next[k] = min_sum + error * error;
    }
    cost = next;
    before = here.first;
    before_count = here.count;
  }
  std::size_t k = std::min_element(cost.begin(), cost.begin() + before_count) - cost.begin();
  for (std::size_t i = values.size(); i-- > 0;) {
    numbers[i] = tried[i].first + static_cast<int>(k);
    k = tried[i].from[k];
  }
}

std::vector<std::size_t> strong_pairs(const BasisFit& basis, const Quantisation& options) {
  const double min_rms = static_cast<double>(options.min_rms) * static_cast<double>(options.step);
  const std::size_t count = basis.pairs.size();
  std::vector<double> power(count, 0);
  double used = 0;
  for (std::size_t t = 0; t < basis.texel_count(); ++t) {
    const float* c = &basis.coefficient[t * count];
    used += std::any_of(c, c + count, [](float value) { return value != 0; }) ? 1 : 0;
    for (std::size_t m = 0; m < count; ++m) power[m] += static_cast<double>(c[m] * c[m]);
  }
  std::vector<std::size_t> kept;
  for (std::size_t m = 0; m < count; ++m)
    if (std::sqrt(power[m] / std::max(used, 1.0)) >= min_rms) kept.push_back(m);
  if (kept.empty()) kept.push_back(0);
  return kept;
}

}  // namespace

std::size_t kept_pair_count(const BasisFit& basis, const Quantisation& options) {
  return strong_pairs(basis, options).size();
}

BasisFit quantise(const BasisFit& basis, const Quantisation& options) {
  const std::vector<std::size_t> kept = strong_pairs(basis, options);
  const std::size_t all = basis.pairs.size();
  const std::size_t count = kept.size();
  const std::size_t texels = basis.texel_count();
  const auto steps_of = [&](std::size_t texel, std::size_t m) {
    return basis.coefficient[texel * all + kept[m]] / options.step;
  };
  std::vector<int> numbers(texels * count);
  for (std::size_t t = 0; t < texels; ++t)
    for (std::size_t m = 0; m < count; ++m)
      numbers[t * count + m] =
          static_cast<int>(std::lround(std::clamp(steps_of(t, m), -max_steps, max_steps)));
  for (int pass = 0; pass < passes; ++pass) {
    const Costs costs(numbers, count, options.row_texels, options.bit_cost);
    parallel_for(0, static_cast<int>(count), [&](std::size_t m) {
      std::vector<float> values(options.row_texels);
      std::vector<int> row(options.row_texels);
      for (std::size_t first = 0; first < texels; first += options.row_texels) {
        for (std::size_t x = 0; x < options.row_texels; ++x) values[x] = steps_of(first + x, m);
        find_cheapest(values, costs, row);
        for (std::size_t x = 0; x < options.row_texels; ++x) numbers[(first + x) * count + m] = row[x];
      }
    });
  }
  BasisFit result;
  result.view_functions = basis.view_functions;
  result.light_functions = basis.light_functions;
  for (const std::size_t m : kept) result.pairs.push_back(basis.pairs[m]);
  for (const int number : numbers) result.coefficient.push_back(options.step * static_cast<float>(number));
  return result;
}

double coded_bytes(const std::vector<float>& values, std::size_t channels, std::size_t width) {
  if (values.empty()) return 0;
  ExrPart part{.width = static_cast<int>(width),
               .height = static_cast<int>(values.size() / channels / width),
               .has_mipmaps = true};
  part.channels.resize(channels);
  ExrPixels pixels{part.width, part.height, std::vector<std::vector<float>>(channels)};
  for (std::size_t i = 0; i < values.size(); ++i) pixels.planes[i % channels].push_back(values[i]);
  return static_cast<double>(exr_packed_bytes(std::move(part), 0, pixels));
}

}  // namespace selvedge
