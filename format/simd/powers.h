// Logarithms and powers of vectors of floats. A fit and a picture spend most of their time in them.
//
// Every element is computed by the same IEEE operations for any width of vector (no fused operations, no sums
// across lanes), so that results have the same bits on every machine.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "format/simd/wide.h"

namespace selvedge {

template <std::size_t Count>
struct Lanes {
  static constexpr std::size_t count = Count;
  typedef float Floats __attribute__((vector_size(4 * Count)));
  typedef std::int32_t Ints __attribute__((vector_size(4 * Count)));
  typedef std::uint32_t Bits __attribute__((vector_size(4 * Count)));

  static constexpr float rounder = 12582912.0F;
  static constexpr std::int32_t rounder_bits = 0x4b400000;

  /// From and to memory of any alignment.
  static SELVEDGE_INLINE void load(const float* from, Floats& to) { std::memcpy(&to, from, sizeof to); }
  static SELVEDGE_INLINE void store(const Floats& from, float* to) { std::memcpy(to, &from, sizeof from); }

  /// ln(x) of normal x > 0, relative error below 2e-7. x = 2^e m with m in [2/3, 4/3); with f = m - 1,
  /// ln m = f - f^2 / 2 + f^3 Q(f), Q interpolated at Chebyshev nodes (error at most 1.8e-8).
  static SELVEDGE_INLINE Floats& natural_log(const Floats& x, Floats& result) {
    constexpr float ln2 = 0.693147180559945309F;
    // Subtracting 2/3's bits makes the exponent field count from mantissa 2/3 instead of 1.
    const Ints bits = (Ints)x;
    const Ints exponent = (bits - 0x3f2aaaab) >> 23;
    // Integers are converted to floats and back in the low bits of 1.5 * 2^23.
    const Floats f = (Floats)(bits - (exponent << 23)) - 1.0F;
    const Floats f2 = f * f;
    Floats q = f * -0.121255807F + 0.13425749F;
    q = q * f - 0.123461902F;
    q = q * f + 0.141183099F;
    q = q * f - 0.166701407F;
    q = q * f + 0.200037803F;
    q = q * f - 0.249999879F;
    q = q * f + 0.333333202F;
    result = ((Floats)(exponent + rounder_bits) - rounder) * ln2 + (f + f2 * (f * q - 0.5F));
    return result;
  }

  /// e^x, clamped to 2^-126 .. 2^127; relative error below 2e-7 + 1.2e-7 |x|. The nearest power of two, times
  /// e^r = 1 + r + r^2 Q(r), |r| <= ln 2 / 2, Q interpolated at Chebyshev nodes (error at most 1e-8).
  static SELVEDGE_INLINE Floats& exponential(const Floats& x, Floats& result) {
    constexpr float ln2 = 0.693147180559945309F;
    constexpr float log2e = 1.44269504088896341F;
    Floats turns = x * log2e;
    turns = turns < -126.0F ? Floats{} - 126.0F : turns;
    turns = turns > 127.0F ? Floats{} + 127.0F : turns;
    // Adding 1.5 * 2^23 rounds to the nearest whole number.
    const Floats rounded = turns + rounder;
    const Floats r = (turns - (rounded - rounder)) * ln2;
    Floats q = r * 0.00139261761F + 0.00836317307F;
    q = q * r + 0.0416665547F;
    q = q * r + 0.16666577F;
    q = q * r + 0.5F;
    const Floats series = (r + (r * r) * q) + 1.0F;
    const Ints scale = ((Ints)rounded - (rounder_bits - 127)) << 23;
    result = series * (Floats)scale;
    return result;
  }

  /// ln(base) and base^exponent; both 0 unless the base is above 1e-30.
  static SELVEDGE_INLINE void log_and_power(const Floats& base, float exponent, Floats& log, Floats& power) {
    // The comparison is written twice: GCC 12 splits a stored comparison of 16 numbers into scalars.
    natural_log(base > 1e-30F ? base : Floats{} + 1.0F, log);
    exponential(log * exponent, power);
    power = base > 1e-30F ? power : Floats{};
  }
};

}  // namespace selvedge
