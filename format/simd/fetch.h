// Transposes groups of four numbers, one group per pixel, to vectors over the pixels. Loads of four and
// shuffles are several times as fast as the CPU's gather instructions.
#pragma once

#include "format/simd/group.h"
#include "format/simd/wide_float.h"

namespace selvedge {

using Floats4 = Lanes<4>::Floats;
using Floats8 = Lanes<8>::Floats;
using Floats16 = Lanes<16>::Floats;

/// Group `offset` of those that begin at `from`.
SELVEDGE_INLINE Floats4 load_group(const Group* from, std::size_t offset) {
  Floats4 result;
  std::memcpy(&result, from + offset, sizeof result);
  return result;
}

// Overloads for each width: interleave numbers of a and b, from the lower and the upper half of every four.
SELVEDGE_INLINE Floats4 interleave_lower(const Floats4& a, const Floats4& b) {
  return __builtin_shufflevector(a, b, 0, 4, 1, 5);
}
SELVEDGE_INLINE Floats4 interleave_upper(const Floats4& a, const Floats4& b) {
  return __builtin_shufflevector(a, b, 2, 6, 3, 7);
}
SELVEDGE_INLINE Floats8 interleave_lower(const Floats8& a, const Floats8& b) {
  return __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
}
SELVEDGE_INLINE Floats8 interleave_upper(const Floats8& a, const Floats8& b) {
  return __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
}
SELVEDGE_INLINE Floats16 interleave_lower(const Floats16& a, const Floats16& b) {
  return __builtin_shufflevector(a, b, 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29);
}
SELVEDGE_INLINE Floats16 interleave_upper(const Floats16& a, const Floats16& b) {
  return __builtin_shufflevector(a, b, 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31);
}

// Concatenates the groups of every fourth pixel from r on.
SELVEDGE_INLINE void gather(const Group* const* from, std::size_t offset, std::size_t r, Floats4& to) {
  to = load_group(from[r], offset);
}
SELVEDGE_INLINE void gather(const Group* const* from, std::size_t offset, std::size_t r, Floats8& to) {
  to = __builtin_shufflevector(load_group(from[r], offset), load_group(from[r + 4], offset), 0, 1, 2, 3, 4, 5,
                               6, 7);
}
SELVEDGE_INLINE void gather(const Group* const* from, std::size_t offset, std::size_t r, Floats16& to) {
  Floats8 first;
  Floats8 second;
  gather(from, offset, r, first);
  gather(from, offset, r + 8, second);
  to = __builtin_shufflevector(first, second, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
}

/// Loads group `offset` of each pixel as four vectors.
template <std::size_t N>
SELVEDGE_INLINE void fetch(const Group* const* from, std::size_t offset, WideFloat<N>* to) {
  using Floats = typename Lanes<N>::Floats;
  Floats row[4];  // NOLINT(modernize-avoid-c-arrays): GCC keeps it in registers
  for (std::size_t r = 0; r < 4; ++r) gather(from, offset, r, row[r]);
  const Floats even_lower = interleave_lower(row[0], row[2]);
  const Floats odd_lower = interleave_lower(row[1], row[3]);
  const Floats even_upper = interleave_upper(row[0], row[2]);
  const Floats odd_upper = interleave_upper(row[1], row[3]);
  to[0].v = interleave_lower(even_lower, odd_lower);
  to[1].v = interleave_upper(even_lower, odd_lower);
  to[2].v = interleave_lower(even_upper, odd_upper);
  to[3].v = interleave_upper(even_upper, odd_upper);
}

}  // namespace selvedge
