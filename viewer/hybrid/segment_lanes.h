// Segments of yarn in the lanes. To be included by code for the lanes (format/simd).
#pragma once

#include <cstddef>

#include "format/fabric/yarns.h"
#include "format/simd/wide_float.h"
#include "viewer/hybrid/fetch.h"

namespace selvedge {

/// What a segment's lanes are fetched as: groups of four floats, the members in their order.
static_assert(offsetof(Yarns::Segment, start) == 0 && offsetof(Yarns::Segment, along) == 12 &&
              offsetof(Yarns::Segment, tangent) == 24 && offsetof(Yarns::Segment, across) == 48 &&
              offsetof(Yarns::Segment, out) == 72 && offsetof(Yarns::Segment, inverse_length2) == 96 &&
              offsetof(Yarns::Segment, station) == 100 && offsetof(Yarns::Segment, stations) == 104 &&
              offsetof(Yarns::Segment, radius) == 108 && offsetof(Yarns::Segment, squeeze) == 120 &&
              sizeof(Yarns::Segment) >= 128);

template <std::size_t N>
struct SegmentLanes {
  /// `flat`: not all are round.
  SELVEDGE_INLINE SegmentLanes(const Group* const* from, bool flat) {
    WideFloat<N> rows[28];  // NOLINT(modernize-avoid-c-arrays): GCC keeps it in registers
    for (std::size_t group = 0; group < 7; ++group) fetch<N>(from, group, rows + 4 * group);
    const auto vector = [&](std::size_t row) { return WideVec3<N>{rows[row], rows[row + 1], rows[row + 2]}; };
    start = vector(0);
    along = vector(3);
    for (std::size_t end = 0; end < 2; ++end) {
      tangent[end] = vector(6 + 3 * end);
      across[end] = vector(12 + 3 * end);
      out[end] = vector(18 + 3 * end);
    }
    inverse_length2 = rows[24];
    station = rows[25];
    stations = rows[26];
    radius = rows[27];
    squeeze_x = WideFloat<N>(0);
    squeeze_y = WideFloat<N>(0);
    if (!flat) return;
    fetch<N>(from, 7, rows);
    squeeze_x = rows[2];
    squeeze_y = rows[3];
  }
  SELVEDGE_INLINE WideVec3<N> squeezed(const WideVec3<N>& p) const {
    const WideFloat<N> part = squeeze_x * p.x + squeeze_y * p.y;
    return {p.x - squeeze_x * part, p.y - squeeze_y * part, p.z};
  }
  SELVEDGE_INLINE WideVec3<N> stretched(const WideVec3<N>& p) const {
    const WideFloat<N> thin = WideFloat<N>(1) - squeeze_x * squeeze_x - squeeze_y * squeeze_y;
    const WideFloat<N> part = (squeeze_x * p.x + squeeze_y * p.y) / thin;
    return {p.x + squeeze_x * part, p.y + squeeze_y * part, p.z};
  }
  WideVec3<N> start, along;
  WideVec3<N> tangent[2], across[2], out[2];  // NOLINT(modernize-avoid-c-arrays)
  WideFloat<N> inverse_length2, station, stations, radius, squeeze_x, squeeze_y;
};

}  // namespace selvedge
