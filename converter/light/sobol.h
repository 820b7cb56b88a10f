// Low-discrepancy points: the first two dimensions of Sobol's sequence under Owen scrambling, hashed as by
// Laine and Karras 2011 in the form of Burley 2020 ("Practical Hash-based Owen Scrambling", JCGT 9(4)). The
// first 2^k points have one point in each elementary interval of area 2^-k, so the error of a mean falls
// faster than with independent points; each single point is uniform, so the mean is unbiased.
#pragma once

#include <cstdint>

#include "format/base/random.h"
#include "format/base/vec.h"

namespace selvedge {

/// Point `index` of the sequence scrambled by `seed`, in [0, 1)^2.
V2d spread_point(std::uint32_t index, std::uint64_t seed);

/// Random numbers of one path in pairs. The first `spread_pairs` are low-discrepancy over the paths of one
/// seed (each pair in an order of its own), later ones are independent.
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
