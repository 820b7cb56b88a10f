// Points that fill the unit square evenly: the first two dimensions of Sobol's sequence under Owen's
// scrambling, hashed as by Laine and Karras 2011 in the form of Burley 2020 ("Practical Hash-based Owen
// Scrambling", JCGT 9(4)). Any 2^k points from the first on have one point in each of the 2^k elementary
// intervals of every shape, so the error of a mean falls faster than with independent points; each point
// alone is uniform, so the mean is unbiased.
#pragma once

#include <cstdint>

#include "format/base/random.h"
#include "format/base/vec.h"

namespace selvedge {

/// Point `index` of the sequence that `seed` scrambles, in [0, 1)^2.
V2d spread_point(std::uint32_t index, std::uint64_t seed);

/// The coordinates of one path: pair after pair, the first `spread_pairs` of them low-discrepancy over the
/// paths of one seed (each pair's order shuffled against the others'), those after that random.
class PathSampler {
 public:
  PathSampler(std::uint32_t index, std::uint64_t seed) : index_(index), seed_(seed), random_(seed, index) {}
  V2d next();

 private:
  static constexpr std::uint64_t spread_pairs = 4;
  std::uint32_t index_;
  std::uint64_t seed_;
  std::uint64_t pair_ = 0;
  Random random_;
};

}  // namespace selvedge
