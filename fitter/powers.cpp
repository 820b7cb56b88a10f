#include "fitter/powers.h"

#include <bit>
#include <cstdint>

// One body, compiled for the baseline and for AVX2 (no fused operations in either, so that the bits agree).
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define SELVEDGE_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define SELVEDGE_WIDE
#endif

namespace selvedge {
namespace {

constexpr float ln2 = 0.693147180559945309F;
constexpr float log2e = 1.44269504088896341F;

/// ln(x) for normal x > 0: exponent and mantissa m in [2/3, 4/3), then 2 atanh((m - 1) / (m + 1)) as its
/// series; |s| <= 1/5, so the first term left out is below 2 s^11 / 11 = 4e-9.
inline float natural_log(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  // Subtracting 2/3's bits makes the exponent field count from mantissa 2/3 instead of 1.
  const std::int32_t shifted = (bits - 0x3f2aaaab) >> 23;
  const auto mantissa = std::bit_cast<float>(bits - shifted * (1 << 23));
  const float s = (mantissa - 1) / (mantissa + 1);
  const float s2 = s * s;
  const float series = 2 * s * (1 + s2 * (1.0F / 3 + s2 * (1.0F / 5 + s2 * (1.0F / 7 + s2 * (1.0F / 9)))));
  return static_cast<float>(shifted) * ln2 + series;
}

/// e^x: the power of two nearest, times the rest by Taylor's series to degree 7 (|rest| <= 0.35, left out
/// 6e-9).
inline float exponential(float x) {
  const float turns = x * log2e;
  const float clamped = turns < -126 ? -126.0F : turns > 127 ? 127.0F : turns;
  // Adding and subtracting 1.5 * 2^23 rounds to the nearest whole number.
  constexpr float rounder = 12582912.0F;
  const float whole = (clamped + rounder) - rounder;
  const float r = (clamped - whole) * ln2;
  const float series =
      1 +
      r * (1 + r * (0.5F + r * (1.0F / 6 +
                                r * (1.0F / 24 + r * (1.0F / 120 + r * (1.0F / 720 + r * (1.0F / 5040)))))));
  const std::int32_t scale = (static_cast<std::int32_t>(whole) + 127) << 23;
  return series * std::bit_cast<float>(scale);
}

}  // namespace

SELVEDGE_WIDE
void powers(const float* base, float exponent, float* logarithm, float* power, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const bool positive = base[i] > 1e-30F;
    const float log = natural_log(positive ? base[i] : 1.0F);
    const float exp = exponential(exponent * log);
    logarithm[i] = positive ? log : 0.0F;
    power[i] = positive ? exp : 0.0F;
  }
}

}  // namespace selvedge
