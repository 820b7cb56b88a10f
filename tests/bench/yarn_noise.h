// Variation along and around yarns, seeded and periodic: the same in every repeat.
#pragma once

#include <cmath>
#include <cstdint>

#include "format/base/random.h"

namespace selvedge {

/// A number of unit variance, evenly spread around 0, for a place of a lattice.
inline double lattice_noise(std::uint64_t seed, std::int64_t a, std::int64_t b = 0) {
  const std::uint64_t bits =
      hash64(hash64(seed ^ hash64(static_cast<std::uint64_t>(a))) ^ static_cast<std::uint64_t>(b));
  return (static_cast<double>(bits >> 11) * 0x1.0p-53 - 0.5) * 3.4641016151377544;
}

/// Smooth noise along a closed line of `cells` cells, of about unit variance; x counts cells. `row` is a line
/// of its own.
inline double closed_noise(std::uint64_t seed, std::int64_t row, int cells, double x) {
  const double low = std::floor(x);
  const double part = x - low;
  const auto wrapped = [&](double cell) {
    return static_cast<std::int64_t>(cell - std::floor(cell / cells) * cells);
  };
  const double a = lattice_noise(seed, row, wrapped(low));
  const double b = lattice_noise(seed, row, wrapped(low + 1));
  // Weights whose squares sum to 1 keep the variance between the lattice's places.
  const double turn = 1.5707963267948966 * part * part * (3 - 2 * part);
  return a * std::cos(turn) + b * std::sin(turn);
}

}  // namespace selvedge
