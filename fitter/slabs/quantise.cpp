#include "fitter/slabs/quantise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "format/base/parallel.h"

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
    for (std::size_t i = 0; i < count.size(); ++i) {
      cost_[i] = price * static_cast<float>(std::log2(all / count[i]));
    }
  }
  float operator()(int difference) const { return cost_[index(difference)]; }

 private:
  static std::size_t index(int difference) {
    return std::clamp(difference, -max_difference, max_difference) + max_difference;
  }
  std::vector<float> cost_;
};

/// A coefficient of a row: its best value, in steps, and the cost of a squared step of error.
struct Target {
  float value = 0;
  float weight = 0;
};

/// Finds the numbers of a row with the smallest sum of rate and error.
void find_cheapest(const std::vector<Target>& targets, const Costs& costs, std::vector<int>& numbers) {
  struct Tried {
    int first = 0;
    int count = 0;
    std::array<std::uint8_t, max_tried> from{};
  };
  std::vector<Tried> tried(targets.size());
  std::array<float, max_tried> cost{};
  int before = 0;
  int before_count = 1;
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const Target& target = targets[i];
    Tried& here = tried[i];
    const int nearest = static_cast<int>(std::lround(std::clamp(target.value, -max_steps, max_steps)));
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
      const float error = target.value - static_cast<float>(number);
      next[k] = min_sum + target.weight * error * error;
    }
    cost = next;
    before = here.first;
    before_count = here.count;
  }
  std::size_t k = std::min_element(cost.begin(), cost.begin() + before_count) - cost.begin();
  for (std::size_t i = targets.size(); i-- > 0;) {
    numbers[i] = tried[i].first + static_cast<int>(k);
    k = tried[i].from[k];
  }
}

std::vector<std::size_t> strong_pairs(const BasisFit& basis, const Quantisation& options) {
  const double min_rms = static_cast<double>(options.min_rms) * static_cast<double>(options.step);
  const std::size_t count = basis.pairs.size();
  std::vector<double> power(count, 0);
  double used = 0;
  for (std::size_t o = 0; o < basis.owners(); ++o) {
    const float* c = &basis.coefficient[o * count];
    used += std::any_of(c, c + count, [](float value) { return value != 0; }) ? 1 : 0;
    for (std::size_t m = 0; m < count; ++m) power[m] += static_cast<double>(c[m] * c[m]);
  }
  std::vector<std::size_t> kept;
  for (std::size_t m = 0; m < count; ++m) {
    if (std::sqrt(power[m] / std::max(used, 1.0)) >= min_rms) kept.push_back(m);
  }
  if (kept.empty()) kept.push_back(0);
  return kept;
}

/// The errors of one product's coefficients for all owners, in steps, which later owners compensate.
class ErrorShaping {
 public:
  ErrorShaping(const SlabOverlaps* overlaps, std::size_t owners) : overlaps_(overlaps), error_(owners, 0) {
    if (overlaps == nullptr) return;
    double sum = 0;
    double seen = 0;
    for (const float own : overlaps->own) {
      sum += static_cast<double>(own);
      seen += own > 0 ? 1 : 0;
    }
    scale_ = static_cast<float>(sum > 0 ? seen / sum : 1);
  }
  /// The best value of an owner, given the errors of the owners that are seen together with it.
  Target target(std::size_t owner, float value) const {
    if (overlaps_ == nullptr) return {value, 1};
    const float own = overlaps_->own[owner];
    if (!(own > 0)) return {0, 0};
    float sum = 0;
    for (std::size_t k = overlaps_->first[owner]; k < overlaps_->first[owner + 1]; ++k) {
      sum += overlaps_->shared[k] * error_[overlaps_->other[k]];
    }
    return {value - sum / own, own * scale_};
  }
  void set(std::size_t owner, float error) { error_[owner] = error; }

 private:
  const SlabOverlaps* overlaps_;
  float scale_ = 1;
  std::vector<float> error_;
};

}  // namespace

SlabOverlaps overlaps_of(const SlabRays& rays, std::size_t entries) {
  const std::size_t per_row = rays.rays;
  // For each entry the rows of the matrix that contain it, so that only its neighbours are visited.
  std::vector<std::size_t> first(entries + 1, 0);
  for (const std::uint32_t entry : rays.entries) {
    if (entry != SlabRays::no_entry) ++first[entry + 1];
  }
  for (std::size_t e = 0; e < entries; ++e) first[e + 1] += first[e];
  std::vector<std::size_t> row_of(first.back());
  std::vector<std::size_t> end(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < rays.entries.size(); ++i) {
    if (rays.entries[i] != SlabRays::no_entry) row_of[end[rays.entries[i]]++] = i / per_row;
  }
  SlabOverlaps result;
  result.own.assign(entries, 0);
  const float unit = 1 / static_cast<float>(per_row * per_row);
  std::vector<float> shared(entries, 0);
  std::vector<std::uint32_t> touched;
  for (std::size_t e = 0; e < entries; ++e) {
    result.first.push_back(result.other.size());
    touched.clear();
    for (std::size_t i = first[e]; i < first[e + 1]; ++i) {
      for (std::size_t ray = row_of[i] * per_row; ray < (row_of[i] + 1) * per_row; ++ray) {
        const std::uint32_t other = rays.entries[ray];
        if (other == SlabRays::no_entry) continue;
        if (shared[other] == 0) touched.push_back(other);
        shared[other] += unit;
      }
    }
    for (const std::uint32_t other : touched) {
      if (other == e) {
        result.own[e] = shared[other];
      } else {
        result.other.push_back(other);
        result.shared.push_back(shared[other]);
      }
      shared[other] = 0;
    }
  }
  result.first.push_back(result.other.size());
  return result;
}

std::size_t kept_pair_count(const BasisFit& basis, const Quantisation& options) {
  return strong_pairs(basis, options).size();
}

BasisFit quantise(const BasisFit& basis, const Quantisation& options, const SlabOverlaps* overlaps) {
  const std::vector<std::size_t> kept = strong_pairs(basis, options);
  const std::size_t all = basis.pairs.size();
  const std::size_t count = kept.size();
  const std::size_t owners = basis.owners();
  const auto steps_of = [&](std::size_t owner, std::size_t m) {
    return basis.coefficient[owner * all + kept[m]] / options.step;
  };
  std::vector<int> numbers(owners * count);
  for (std::size_t o = 0; o < owners; ++o) {
    for (std::size_t m = 0; m < count; ++m) {
      numbers[o * count + m] =
          static_cast<int>(std::lround(std::clamp(steps_of(o, m), -max_steps, max_steps)));
    }
  }
  std::vector<ErrorShaping> shaping(count, ErrorShaping(overlaps, owners));
  for (int pass = 0; pass < passes; ++pass) {
    const Costs costs(numbers, options.entries * count, options.width, options.price);
    parallel_for(0, static_cast<int>(count), [&](std::size_t m) {
      std::vector<Target> targets(options.width);
      std::vector<int> row(options.width);
      for (std::size_t entry = 0; entry < options.entries; ++entry) {
        for (std::size_t first = entry; first < owners; first += options.width * options.entries) {
          for (std::size_t x = 0; x < options.width; ++x) {
            const std::size_t owner = first + x * options.entries;
            targets[x] = shaping[m].target(owner, steps_of(owner, m));
          }
          find_cheapest(targets, costs, row);
          for (std::size_t x = 0; x < options.width; ++x) {
            const std::size_t owner = first + x * options.entries;
            numbers[owner * count + m] = row[x];
            shaping[m].set(owner, static_cast<float>(row[x]) - steps_of(owner, m));
          }
        }
      }
    });
  }
  BasisFit result;
  result.view = basis.view;
  result.light = basis.light;
  for (const std::size_t m : kept) result.pairs.push_back(basis.pairs[m]);
  for (const int number : numbers) result.coefficient.push_back(options.step * static_cast<float>(number));
  return result;
}

}  // namespace selvedge
