#include "fitter/lobes/lobe_fit.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "format/simd/wide.h"

namespace selvedge {
namespace {

/// Number of exponents: 1, 4, 16, so that each power is two squarings of the one before.
constexpr std::size_t exponents = 3;

/// Each component is -1, 0 or 1; -z alone is left out, as no light reaches it.
const std::vector<V3d>& dictionary() {
  static const std::vector<V3d> entries = [] {
    std::vector<V3d> list;
    for (int x = -1; x <= 1; ++x)
      for (int y = -1; y <= 1; ++y)
        for (int z = -1; z <= 1; ++z)
          if (x != 0 || y != 0 || z > 0) list.emplace_back(x, y, z);
    return list;
  }();
  return entries;
}

LobeShape shape_of(std::size_t entry) {
  const V3d& d = dictionary()[(entry - 1) / exponents];
  return {{d.x, d.y, d.z}, std::pow(4.0, static_cast<double>((entry - 1) % exponents))};
}

/// Sixteen partial sums, then their sum: the same bits for any width of vectors.
SELVEDGE_WIDE
float inner_product(const float* a, const float* b, std::size_t count) {
  std::array<float, 16> sum{};
  for (std::size_t i = 0; i < count; i += 16)
    for (std::size_t k = 0; k < 16; ++k) sum[k] += a[i + k] * b[i + k];
  float total = 0;
  for (std::size_t k = 0; k < 8; ++k) total += sum[k] + sum[k + 8];
  return total;
}

/// weight * base^(1, 4, 16) for one light and all views, at to[0], to[size] and to[2 * size].
SELVEDGE_WIDE
void fill_powers(const float* x, const float* y, const float* z, const V3f& d, const float* weight,
                 std::size_t views, std::size_t size, float* to) {
  for (std::size_t v = 0; v < views; ++v) {
    const float base = d.x * x[v] + d.y * y[v] + d.z * z[v];
    const float b = base > 0 ? base : 0.0F;
    const float b4 = (b * b) * (b * b);
    const float b16 = (b4 * b4) * (b4 * b4);
    to[v] = weight[v] * b;
    to[size + v] = weight[v] * b4;
    to[2 * size + v] = weight[v] * b16;
  }
}

/// A set of dictionary entries with its least-squares solution.
struct Candidate {
  std::vector<std::size_t> entries;
  std::vector<double> sizes;  ///< rho first
  double value = 0;           ///< lower is better

  bool operator<(const Candidate& other) const {
    return value != other.value ? value < other.value : entries < other.entries;
  }
};

bool same_directions(const Candidate& a, const Candidate& b) {
  std::vector<std::size_t> of_a;
  std::vector<std::size_t> of_b;
  for (const std::size_t entry : a.entries) of_a.push_back((entry - 1) / exponents);
  for (const std::size_t entry : b.entries) of_b.push_back((entry - 1) / exponents);
  std::ranges::sort(of_a);
  std::ranges::sort(of_b);
  return of_a == of_b;
}

}  // namespace

void StartSearch::set_samples(const TexelSamples& samples) {
  views_ = samples.view_count;
  // Half of the lights, in a pattern without a direction (Thue-Morse).
  std::vector<std::size_t> lights;
  for (std::size_t l = 0; l < samples.lights.size(); ++l)
    if (samples.lights.size() < 16 || std::popcount(l) % 2 == 0) lights.push_back(l);
  const std::size_t views = samples.stride();
  const std::size_t entries = dictionary().size() * exponents;
  size_ = lights.size() * views;
  columns_.resize((entries + 1) * size_);
  for (auto& radiance : radiance_) radiance.resize(size_);
  products_.resize(entries + 1);
  for (std::vector<double>& row : products_) row.clear();
  std::vector<float> root(views);
  std::vector<float> weight(views);
  for (std::size_t v = 0; v < views; ++v) root[v] = static_cast<float>(std::sqrt(samples.view_weights[v]));
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const V3f& light = samples.lights[lights[i]];
    for (std::size_t v = 0; v < views; ++v) weight[v] = root[v] * light.z;
    std::ranges::copy(weight, columns_.begin() + static_cast<std::ptrdiff_t>(i * views));
    for (std::size_t c = 0; c < 3; ++c) {
      const float* r = &samples.radiance[c][lights[i] * views];
      for (std::size_t v = 0; v < views; ++v) radiance_[c][i * views + v] = root[v] * r[v];
    }
    for (std::size_t d = 0; d < dictionary().size(); ++d) {
      fill_powers(samples.view_xyz[0].data(), samples.view_xyz[1].data(), samples.view_xyz[2].data(),
                  light * V3f(dictionary()[d]), weight.data(), views, size_,
                  &columns_[(1 + d * exponents) * size_ + i * views]);
    }
  }
}

double StartSearch::product(std::size_t a, std::size_t b) {
  std::vector<double>& row = products_[a];
  if (row.empty())
    for (std::size_t i = 0; i < products_.size(); ++i)
      row.push_back(static_cast<double>(inner_product(column(a), column(i), size_)));
  return row[b];
}

std::vector<ChannelState> StartSearch::starts(int channel, int lobes, std::size_t count) {
  constexpr std::size_t beam = 8;
  const std::size_t entries = products_.size();
  const std::vector<float>& radiance = radiance_[channel];
  std::vector<double> cross(entries);
  std::vector<double> square(entries);
  for (std::size_t i = 0; i < entries; ++i) {
    cross[i] = static_cast<double>(inner_product(column(i), radiance.data(), size_));
    square[i] = static_cast<double>(inner_product(column(i), column(i), size_));
  }
  std::vector<Candidate> best{Candidate{{}, {square[0] > 0 ? cross[0] / square[0] : 0}, 0}};
  for (int lobe = 0; lobe < lobes; ++lobe) {
    std::vector<Candidate> next;
    for (const Candidate& from : best) {
      for (std::size_t entry = 1; entry < entries; ++entry) {
        if (std::ranges::find(from.entries, entry) != from.entries.end()) continue;
        Candidate candidate{from.entries, {}, 0};
        candidate.entries.push_back(entry);
        const std::size_t n = candidate.entries.size() + 1;
        const auto at = [&](std::size_t i) { return i == 0 ? std::size_t{0} : candidate.entries[i - 1]; };
        std::vector<double> matrix(n * n);
        std::vector<double> x(n);
        std::vector<char> fixed(n, 0);
        for (std::size_t i = 0; i < n; ++i) {
          x[i] = cross[at(i)];
          for (std::size_t j = 0; j < i; ++j) {
            // Rows of entries in kept sets, so that few rows are computed.
            matrix[i * n + j] = matrix[j * n + i] = product(at(j), at(i));
          }
          matrix[i * n + i] = square[at(i)] * (1 + 1e-6);
        }
        const std::vector<double> whole = matrix;
        if (!solve_symmetric(matrix, x, fixed)) continue;
        if (x[0] < 0) {
          matrix = whole;
          for (std::size_t i = 0; i < n; ++i) x[i] = cross[at(i)];
          fixed[0] = 1;
          if (!solve_symmetric(matrix, x, fixed)) continue;
        }
        if (std::ranges::any_of(x, [](double size) { return !(size >= 0); })) continue;
        for (std::size_t i = 0; i < n; ++i) candidate.value -= x[i] * cross[at(i)];
        candidate.sizes = std::move(x);
        next.push_back(std::move(candidate));
      }
    }
    std::sort(next.begin(), next.end());
    // Every set occurs once for each order of its entries.
    const auto is_again = [](const Candidate& a, const Candidate& b) {
      return same_directions(a, b) && a.value == b.value;
    };
    next.erase(std::unique(next.begin(), next.end(), is_again), next.end());
    const bool last = lobe + 1 == lobes;
    std::vector<Candidate> kept;
    for (Candidate& candidate : next) {
      if (kept.size() >= (last ? count : beam)) break;
      const bool known = last && std::ranges::any_of(kept, [&](const Candidate& other) {
                           return same_directions(candidate, other);
                         });
      if (!known) kept.push_back(std::move(candidate));
    }
    if (kept.empty()) {
      // No entry lowers the error: lobes of size 0, which the search may enlarge.
      for (Candidate& candidate : best) {
        candidate.entries.push_back(1 + lobe * exponents % (entries - 1));
        candidate.sizes.push_back(0);
      }
      if (last) best.resize(1);
      continue;
    }
    best = std::move(kept);
  }
  std::vector<ChannelState> result;
  for (const Candidate& candidate : best) {
    ChannelState state;
    for (const std::size_t entry : candidate.entries) state.shapes.push_back(shape_of(entry));
    state.sizes = candidate.sizes;
    state.table.assign(views_, 1);
    result.push_back(std::move(state));
  }
  return result;
}

std::vector<ChannelState> StartSearch::with_added_lobe(ChannelProblem& problem, const ChannelState& state,
                                                       std::size_t count) {
  std::vector<ChannelState> states;
  constexpr std::size_t middle = 2;  // the entries with the middle exponent, which the search adapts
  for (std::size_t entry = middle; entry <= dictionary().size() * exponents; entry += exponents) {
    ChannelState& next = states.emplace_back(state);
    next.shapes.push_back(shape_of(entry));
    next.sizes.push_back(0);
    problem.evaluate(next, 1);
  }
  std::ranges::stable_sort(states,
                           [](const ChannelState& a, const ChannelState& b) { return a.cost < b.cost; });
  states.resize(std::min(count, states.size()));
  return states;
}

}  // namespace selvedge
