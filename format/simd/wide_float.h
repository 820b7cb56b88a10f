// A vector of floats as a scalar type, so that templates of this library work on several pixels at once.
//
// Every element is computed by the same IEEE operations for any width: the same bits on every machine. All
// functions are inlined into bodies that are compiled for one processor, so no vector is passed to a call.
// Files that use this header are compiled with -Wno-psabi, because -Wpsabi warns of such calls, and with
// -fno-math-errno and -fno-trapping-math, without which square roots stay scalar.
#pragma once

#include "format/simd/powers.h"

namespace selvedge {

template <std::size_t N>
struct WideFloat {
  using Floats = typename Lanes<N>::Floats;
  Floats v;

  WideFloat() = default;
  SELVEDGE_INLINE WideFloat(float all) : v(Floats{} + all) {}  // NOLINT(google-explicit-constructor)
  SELVEDGE_INLINE explicit WideFloat(const Floats& numbers) : v(numbers) {}
  /// N numbers from memory of any alignment.
  static SELVEDGE_INLINE WideFloat load(const float* from) {
    WideFloat result;
    std::memcpy(&result.v, from, sizeof result.v);
    return result;
  }
  SELVEDGE_INLINE void store(float* to) const { std::memcpy(to, &v, sizeof v); }

  friend SELVEDGE_INLINE WideFloat operator+(const WideFloat& a, const WideFloat& b) {
    return WideFloat(a.v + b.v);
  }
  friend SELVEDGE_INLINE WideFloat operator-(const WideFloat& a, const WideFloat& b) {
    return WideFloat(a.v - b.v);
  }
  friend SELVEDGE_INLINE WideFloat operator*(const WideFloat& a, const WideFloat& b) {
    return WideFloat(a.v * b.v);
  }
  friend SELVEDGE_INLINE WideFloat operator/(const WideFloat& a, const WideFloat& b) {
    return WideFloat(a.v / b.v);
  }
  SELVEDGE_INLINE WideFloat operator-() const { return WideFloat(-v); }
  SELVEDGE_INLINE WideFloat& operator+=(const WideFloat& b) { return *this = *this + b; }
  SELVEDGE_INLINE WideFloat& operator*=(const WideFloat& b) { return *this = *this * b; }
};

/// `yes` where a > b, else `no`. (The result of a comparison has no type of its own: GCC 12 splits a stored
/// one of 16 numbers into scalars.)
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> if_greater(const WideFloat<N>& a, const WideFloat<N>& b, const WideFloat<N>& yes,
                                        const WideFloat<N>& no) {
  return WideFloat<N>(a.v > b.v ? yes.v : no.v);
}

/// Whether a > b for any of the numbers.
template <std::size_t N>
SELVEDGE_INLINE bool any_greater(const WideFloat<N>& a, const WideFloat<N>& b) {
  const WideFloat<N> found = if_greater(a, b, WideFloat<N>(1), WideFloat<N>(0));
  std::uint64_t bits[N / 2];  // NOLINT(modernize-avoid-c-arrays): GCC keeps it in a register
  std::memcpy(bits, &found.v, sizeof bits);
  std::uint64_t any = 0;
  for (std::size_t i = 0; i < N / 2; ++i) any |= bits[i];
  return any != 0;
}

/// The smaller; `b` if one of them is NaN.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> min(const WideFloat<N>& a, const WideFloat<N>& b) {
  return if_greater(b, a, a, b);
}

/// The larger; `b` if one of them is NaN.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> max(const WideFloat<N>& a, const WideFloat<N>& b) {
  return if_greater(a, b, a, b);
}

template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> abs(const WideFloat<N>& a) {
  using Lane = Lanes<N>;
  return WideFloat<N>((typename Lane::Floats)((typename Lane::Ints)a.v & 0x7fffffff));
}

template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> sqrt(const WideFloat<N>& a) {
  float numbers[N];  // NOLINT(modernize-avoid-c-arrays): GCC keeps it in a register
  a.store(numbers);
  for (std::size_t i = 0; i < N; ++i) numbers[i] = __builtin_sqrtf(numbers[i]);
  return WideFloat<N>::load(numbers);
}

/// The largest integer not above a, for |a| < 2^22; other values are returned unchanged.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> floor(const WideFloat<N>& a) {
  // Adding 1.5 * 2^23 rounds to the nearest whole number.
  const WideFloat<N> rounder(12582912.0F);
  const WideFloat<N> rounded = (a + rounder) - rounder;
  const WideFloat<N> whole = if_greater(rounded, a, rounded - WideFloat<N>(1), rounded);
  return if_greater(WideFloat<N>(4194304.0F), abs(a), whole, a);
}

// GCC 12 cannot convert vectors of dependent types: hence an overload for each width.
#define SELVEDGE_TO_WHOLE(count)                                                  \
  SELVEDGE_INLINE void store_whole(const WideFloat<count>& a, std::int32_t* to) { \
    typedef std::int32_t Whole##count __attribute__((vector_size(4 * (count))));  \
    const Whole##count whole = __builtin_convertvector(a.v, Whole##count);        \
    std::memcpy(to, &whole, sizeof whole);                                        \
  }
/// Truncates towards 0; |a| < 2^31.
SELVEDGE_TO_WHOLE(4)
SELVEDGE_TO_WHOLE(8)
SELVEDGE_TO_WHOLE(16)
#undef SELVEDGE_TO_WHOLE

/// The arc tangent of x in [-1, 1] to 1e-7: a polynomial interpolated at Chebyshev nodes in x^2.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> wide_arctan(const WideFloat<N>& x) {
  const WideFloat<N> s = x * x;
  WideFloat<N> sum = s * WideFloat<N>(-0.00455979211F) + WideFloat<N>(0.0237805191F);
  sum = sum * s + WideFloat<N>(-0.0588297546F);
  sum = sum * s + WideFloat<N>(0.0986886546F);
  sum = sum * s + WideFloat<N>(-0.140032902F);
  sum = sum * s + WideFloat<N>(0.199669614F);
  sum = sum * s + WideFloat<N>(-0.333318114F);
  sum = sum * s + WideFloat<N>(0.999999881F);
  return sum * x;
}

template <std::size_t N>
struct WideVec3 {
  WideFloat<N> x, y, z;
  SELVEDGE_INLINE WideFloat<N> dot(const WideVec3& b) const { return x * b.x + y * b.y + z * b.z; }
  SELVEDGE_INLINE WideVec3 cross(const WideVec3& b) const {
    return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x};
  }
  friend SELVEDGE_INLINE WideVec3 operator+(const WideVec3& a, const WideVec3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend SELVEDGE_INLINE WideVec3 operator-(const WideVec3& a, const WideVec3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend SELVEDGE_INLINE WideVec3 operator*(const WideVec3& a, const WideFloat<N>& b) {
    return {a.x * b, a.y * b, a.z * b};
  }
  friend SELVEDGE_INLINE WideVec3 operator*(const WideVec3& a, const WideVec3& b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
  }
};

}  // namespace selvedge
