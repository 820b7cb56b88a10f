#include "converter/light/sobol.h"

#include <array>

namespace selvedge {
namespace {

std::uint32_t reverse_bits(std::uint32_t x) {
  x = ((x >> 1) & 0x55555555U) | ((x & 0x55555555U) << 1);
  x = ((x >> 2) & 0x33333333U) | ((x & 0x33333333U) << 2);
  x = ((x >> 4) & 0x0f0f0f0fU) | ((x & 0x0f0f0f0fU) << 4);
  return __builtin_bswap32(x);
}

/// Flips each bit by a hash of the bits below it.
std::uint32_t permute_from_below(std::uint32_t x, std::uint32_t seed) {
  x += seed;
  x ^= x * 0x6c50b47cU;
  x ^= x * 0xb82f1e52U;
  x ^= x * 0xc7afe638U;
  x ^= x * 0x8d22f6e6U;
  return x;
}

/// Owen's scrambling of a number whose bits are already reversed.
std::uint32_t scrambled(std::uint32_t reversed, std::uint32_t seed) {
  return reverse_bits(permute_from_below(reversed, seed));
}

/// The second dimension of Sobol's sequence, reversed: the columns of Pascal's triangle modulo 2.
std::uint32_t reversed_sobol_y(std::uint32_t index) {
  static constexpr auto columns = [] {
    std::array<std::uint32_t, 32> c{};
    std::uint32_t v = 1;
    for (auto& column : c) {
      column = v;
      v ^= v << 1;
    }
    return c;
  }();
  std::uint32_t y = 0;
  for (std::size_t bit = 0; index != 0; ++bit, index >>= 1) {
    if ((index & 1U) != 0) y ^= columns[bit];
  }
  return y;
}

}  // namespace

V2d spread_point(std::uint32_t index, std::uint64_t seed) {
  // The first dimension is the index with its bits reversed: reversed again, the index itself.
  const std::uint32_t x = scrambled(index, static_cast<std::uint32_t>(seed));
  const std::uint32_t y = scrambled(reversed_sobol_y(index), static_cast<std::uint32_t>(seed >> 32));
  return {x * 0x1.0p-32, y * 0x1.0p-32};
}

V2d PathSampler::next() {
  if (pair_ >= spread_pairs) {
    const double x = random_.uniform();
    return {x, random_.uniform()};
  }
  const std::uint64_t hash = mix(seed_ ^ mix(++pair_));
  const std::uint32_t order =
      reverse_bits(permute_from_below(reverse_bits(index_), static_cast<std::uint32_t>(hash)));
  return spread_point(order, mix(hash));
}

}  // namespace selvedge
