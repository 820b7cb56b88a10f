#include "fitter/slabs/quantise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "format/base/parallel.h"

namespace selvedge {
namespace {

/// Differences beyond this cost as much as this.
constexpr int max_difference = 128;
/// Half precision has so many multiples of a step.
constexpr float max_steps = 2048;
/// Numbers that are tried for a coefficient, those from the nearest towards 0 and one beyond.
constexpr int max_tried = 7;
constexpr int passes = 2;

/// The cost of differences: price times information, counted in the numbers of the pass before.
class Costs {
 public:
  /// `numbers`: [texel * channels + channel], in the order in which a row is coded.
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
    return static_cast<std::size_t>(std::clamp(difference, -max_difference, max_difference) + max_difference);
  }
  std::vector<float> cost_;
};

/// One coefficient of a row: its best value, in steps, and the cost of a squared step of error.
struct Target {
  float value = 0;
  float weight = 0;
};

/// The cheapest numbers of a row.
void cheapest(const std::vector<Target>& targets, const Costs& costs, std::vector<int>& numbers) {
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
      float least = std::numeric_limits<float>::infinity();
      for (int j = 0; j < before_count; ++j) {
        const float sum = cost[j] + costs(number - before - j);
        if (sum >= least) continue;
        least = sum;
        here.from[k] = static_cast<std::uint8_t>(j);
      }
      const float error = target.value - static_cast<float>(number);
      next[k] = least + target.weight * error * error;
    }
    cost = next;
    before = here.first;
    before_count = here.count;
  }
  auto k =
      static_cast<std::size_t>(std::min_element(cost.begin(), cost.begin() + before_count) - cost.begin());
  for (std::size_t i = targets.size(); i-- > 0;) {
    numbers[i] = tried[i].first + static_cast<int>(k);
    k = tried[i].from[k];
  }
}

std::vector<std::size_t> strong_pairs(const BasisFit& basis, const Quantisation& how) {
  const double least = static_cast<double>(how.least) * static_cast<double>(how.step);
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
    if (std::sqrt(power[m] / std::max(used, 1.0)) >= least) kept.push_back(m);
  }
  if (kept.empty()) kept.push_back(0);
  return kept;
}

/// The coefficients of one product as they are shaped: all owners, in steps.
class Shaping {
 public:
  Shaping(const SlabOverlaps* overlaps, std::size_t owners) : overlaps_(overlaps), error_(owners, 0) {
    if (overlaps == nullptr) return;
    double sum = 0;
    double seen = 0;
    for (const float own : overlaps->own) {
      sum += static_cast<double>(own);
      seen += own > 0 ? 1 : 0;
    }
    scale_ = static_cast<float>(sum > 0 ? seen / sum : 1);
  }
  /// Where the number of an owner should be, given the errors of those that are seen with it.
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
  // Of each entry the rows of the matrix in which it is, row by row, to go through its neighbours alone.
  std::vector<std::size_t> first(entries + 1, 0);
  for (const std::uint32_t entry : rays.met) {
    if (entry != SlabRays::nothing) ++first[entry + 1];
  }
  for (std::size_t e = 0; e < entries; ++e) first[e + 1] += first[e];
  std::vector<std::size_t> row_of(first.back());
  std::vector<std::size_t> end(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < rays.met.size(); ++i) {
    if (rays.met[i] != SlabRays::nothing) row_of[end[rays.met[i]]++] = i / per_row;
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
        const std::uint32_t other = rays.met[ray];
        if (other == SlabRays::nothing) continue;
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

std::size_t pairs_kept(const BasisFit& basis, const Quantisation& how) {
  return strong_pairs(basis, how).size();
}

BasisFit quantised(const BasisFit& basis, const Quantisation& how, const SlabOverlaps* overlaps) {
  const std::vector<std::size_t> kept = strong_pairs(basis, how);
  const std::size_t all = basis.pairs.size();
  const std::size_t count = kept.size();
  const std::size_t owners = basis.owners();
  const auto steps_of = [&](std::size_t owner, std::size_t m) {
    return basis.coefficient[owner * all + kept[m]] / how.step;
  };
  std::vector<int> numbers(owners * count);
  for (std::size_t o = 0; o < owners; ++o) {
    for (std::size_t m = 0; m < count; ++m) {
      numbers[o * count + m] =
          static_cast<int>(std::lround(std::clamp(steps_of(o, m), -max_steps, max_steps)));
    }
  }
  std::vector<Shaping> shaping(count, Shaping(overlaps, owners));
  for (int pass = 0; pass < passes; ++pass) {
    const Costs costs(numbers, how.entries * count, how.width, how.price);
    parallel_for(0, static_cast<int>(count), [&](std::size_t m) {
      std::vector<Target> targets(how.width);
      std::vector<int> row(how.width);
      for (std::size_t entry = 0; entry < how.entries; ++entry) {
        for (std::size_t first = entry; first < owners; first += how.width * how.entries) {
          for (std::size_t x = 0; x < how.width; ++x) {
            const std::size_t owner = first + x * how.entries;
            targets[x] = shaping[m].target(owner, steps_of(owner, m));
          }
          cheapest(targets, costs, row);
          for (std::size_t x = 0; x < how.width; ++x) {
            const std::size_t owner = first + x * how.entries;
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
  for (const int number : numbers) result.coefficient.push_back(how.step * static_cast<float>(number));
  return result;
}

}  // namespace selvedge
