// Seeded random numbers, the same on every machine and for any number of threads: each use has a generator of
// its own, from a seed and up to three indices.
#pragma once

#include <cstdint>

namespace selvedge {

/// A well-mixed 64-bit hash of one value (the finaliser of SplitMix64, Steele et al. 2014).
constexpr std::uint64_t hash64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// SplitMix64; construction is cheap enough for one generator per texel and view.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed, std::uint64_t a = 0, std::uint64_t b = 0, std::uint64_t c = 0)
      : state_(hash64(hash64(hash64(hash64(seed) ^ a) ^ b) ^ c)) {}

  constexpr std::uint64_t next() { return hash64(state_++); }

  /// Uniform in [0, 1) with 53 bits.
  constexpr double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }

 private:
  std::uint64_t state_;
};

}  // namespace selvedge
