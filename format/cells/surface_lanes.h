// The surface of yarn at several points at once: the twin of Yarns::point_at() and
// format/fabric/yarn_strands.h, held to them by tests. For files that use format/simd/wide_float.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <numbers>

#include "format/fabric/lifted.h"
#include "format/fabric/yarns.h"
#include "format/simd/fetch.h"

namespace selvedge {

template <std::size_t N>
SELVEDGE_INLINE WideVec3<N> unit(const WideVec3<N>& v) {
  return v * (WideFloat<N>(1) / sqrt(v.dot(v)));
}

/// Layout of a segment's lanes: groups of four floats, the members in their order.
static_assert(offsetof(Yarns::Segment, start) == 0 && offsetof(Yarns::Segment, along) == 12 &&
              offsetof(Yarns::Segment, tangent) == 24 && offsetof(Yarns::Segment, across) == 48 &&
              offsetof(Yarns::Segment, axis_to_ply) == 72 &&
              offsetof(Yarns::Segment, inverse_length2) == 96 &&
              offsetof(Yarns::Segment, start_station) == 100 &&
              offsetof(Yarns::Segment, station_span) == 104 && offsetof(Yarns::Segment, radius) == 108 &&
              offsetof(Yarns::Segment, squeeze) == 112 && sizeof(Yarns::Segment) >= 128);

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
      axis_to_ply[end] = vector(18 + 3 * end);
    }
    inverse_length2 = rows[24];
    station = rows[25];
    station_span = rows[26];
    radius = rows[27];
    squeeze = {WideFloat<N>(0), WideFloat<N>(0), WideFloat<N>(0)};
    if (!flat) return;
    fetch<N>(from, 7, rows);
    squeeze = vector(0);
  }
  SELVEDGE_INLINE WideVec3<N> squeezed(const WideVec3<N>& p) const { return p - squeeze * squeeze.dot(p); }
  SELVEDGE_INLINE WideVec3<N> stretched(const WideVec3<N>& p) const {
    return p + squeeze * (squeeze.dot(p) / (WideFloat<N>(1) - squeeze.dot(squeeze)));
  }
  WideVec3<N> start, along, squeeze;
  WideVec3<N> tangent[2], across[2], axis_to_ply[2];  // NOLINT(modernize-avoid-c-arrays)
  WideFloat<N> inverse_length2, station, station_span, radius;
};

// Strands at many points at once: the twin of format/fabric/yarn_strands.h, held to it by a test.

/// Strands that are not seen apart make their yarn so much darker, and the square of the highlight's width so
/// much larger: means over strands (spec/brdf.md, "Over a surface").
constexpr float unresolved_strand_loss = 0.06F;
constexpr float unresolved_roughness2 = 0.05F;
constexpr float unresolved_lustre_loss = 0.1F;  ///< fraction of the lustre that goes with them

/// Strands of the curves of at most sixteen lanes.
struct StrandCurves {
  using Floats = std::array<float, 16>;
  alignas(64) Floats strands, shift, lays, pieces, irregularity, swells, contrast;
  alignas(64) Floats marl, marl_per_row;           ///< per row: a ply's shade is 1 - marl + paler row
  alignas(64) Floats first_row, next_first_row;    ///< StrandRows
  alignas(64) Floats width;                        ///< of a strand, mm
  alignas(64) Floats sense_x, sense_y;             ///< Yarns::Geometry::strand_sense; 0: no strands
  alignas(64) std::array<std::uint32_t, 16> seed;  ///< hashed
};

/// Turns of an angle, in [-1/2, 1/2].
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> wide_turns(const WideFloat<N>& cosine, const WideFloat<N>& sine) {
  using Wide = WideFloat<N>;
  const Wide x = abs(cosine);
  const Wide y = abs(sine);
  const Wide ratio = min(x, y) / max(max(x, y), Wide(1e-30F));
  const Wide eighth = wide_arctan(ratio) * Wide(0.5F * std::numbers::inv_pi_v<float>);
  const Wide quarter = if_greater(y, x, Wide(0.25F) - eighth, eighth);
  const Wide half = if_greater(Wide(0), cosine, Wide(0.5F) - quarter, quarter);
  return if_greater(Wide(0), sine, -half, half);
}

/// The noise of lanes; whole numbers of at most 23 bits are floats as well as bits.
template <std::size_t N>
struct StrandNoiseLanes {
  using Wide = WideFloat<N>;
  using Bits = typename Lanes<N>::Bits;
  using Floats = typename Lanes<N>::Floats;
  Bits seed;

  static SELVEDGE_INLINE Bits to_bits(const Wide& whole) { return (Bits)(whole.v + 8388608.0F) & 0x7fffffU; }
  static SELVEDGE_INLINE Wide to_float(const Bits& bits) {
    return Wide((Floats)(bits | 0x4b000000U)) - Wide(8388608.0F);
  }
  static SELVEDGE_INLINE Bits hash(Bits x) {
    x = (x ^ x >> 16) * 0x7feb352dU;
    x = (x ^ x >> 15) * 0x846ca68bU;
    return x ^ x >> 16;
  }
  SELVEDGE_INLINE Bits lattice_bits(const Bits& row, const Bits& place) const {
    return hash(seed ^ (row << 16 | place));
  }
  SELVEDGE_INLINE Wide offset(const Wide& row) const {
    return to_float(lattice_bits(to_bits(row), Bits{} + offset_noise_place) >> 9) * Wide(0x1p-23F);
  }
  static SELVEDGE_INLINE Wide value(const Bits& bits, int k) {
    return (to_float(bits >> 8 * k & 255U) - Wide(127.5F)) * Wide(0.013531648F);
  }
};

template <std::size_t N>
struct StrandBlendLanes {
  WideFloat<N> current_weight, next_weight;
  SELVEDGE_INLINE explicit StrandBlendLanes(const WideFloat<N>& part) {
    const WideFloat<N> one(1);
    const WideFloat<N> smooth = part * part * (WideFloat<N>(3) - WideFloat<N>(2) * part);
    const WideFloat<N> scale = one / sqrt(smooth * smooth + (one - smooth) * (one - smooth));
    current_weight = (one - smooth) * scale;
    next_weight = smooth * scale;
  }
  SELVEDGE_INLINE WideFloat<N> noise(const typename Lanes<N>::Bits& a, const typename Lanes<N>::Bits& b,
                                     int k) const {
    return current_weight * StrandNoiseLanes<N>::value(a, k) + next_weight * StrandNoiseLanes<N>::value(b, k);
  }
};

template <std::size_t N>
struct StrandPerturbationLanes {
  WideFloat<N> across, along, turn;
  WideFloat<N> shade;   ///< relative change of the albedo
  WideFloat<N> colour;  ///< factor of the albedo, of the yarn's irregularity
};

/// strand_perturbation() of the lanes from i on, at the angle and fraction of the chain that lie there.
template <std::size_t N>
SELVEDGE_INLINE StrandPerturbationLanes<N> strand_perturbation_lanes(const StrandCurves& curves,
                                                                     std::size_t i,
                                                                     const WideFloat<N>& cosine,
                                                                     const WideFloat<N>& sine,
                                                                     WideFloat<N> fraction) {
  using Wide = WideFloat<N>;
  using Noise = StrandNoiseLanes<N>;
  using Bits = typename Lanes<N>::Bits;
  const Wide zero(0);
  const Wide one(1);
  Noise noise;
  std::memcpy(&noise.seed, &curves.seed[i], sizeof noise.seed);
  fraction = fraction - floor(fraction);

  const Wide swells = Wide::load(&curves.swells[i]);
  const Wide swell = fraction * swells;
  const Wide first = min(floor(swell), swells - one);
  const Wide second = if_greater(swells, first + one, first + one, zero);
  const Bits yarn = Bits{} + yarn_noise_row;
  const StrandBlendLanes<N> of_swell(swell - first);
  const Wide colour = of_swell.noise(noise.lattice_bits(yarn, Noise::to_bits(first)),
                                     noise.lattice_bits(yarn, Noise::to_bits(second)), 3);

  const Wide sense_x = Wide::load(&curves.sense_x[i]);
  const Wide sense_y = Wide::load(&curves.sense_y[i]);
  const Wide sense = sense_x * sense_y;
  const Wide strands = Wide::load(&curves.strands[i]);
  Wide turns = wide_turns<N>(sense_x * cosine, sense_y * sine) - Wide::load(&curves.lays[i]) * fraction;
  turns = turns - floor(turns);
  const Wide strand = turns * strands;
  const Wide own = min(floor(strand), strands - one);
  const Wide row = own + Wide::load(&curves.first_row[i]);
  Wide later = own + Wide::load(&curves.shift[i]);
  later = if_greater(strands, later, later, later - strands) + Wide::load(&curves.next_first_row[i]);
  const Wide first_row = Wide::load(&curves.first_row[i]);
  const Wide at_ply = first_row + fraction * (Wide::load(&curves.next_first_row[i]) - first_row);
  const Wide shade = one - Wide::load(&curves.marl[i]) + Wide::load(&curves.marl_per_row[i]) * at_ply;
  const Wide pieces = Wide::load(&curves.pieces[i]);
  const Wide offset = noise.offset(row);
  const Wide place = fraction * pieces + offset + fraction * (noise.offset(later) - offset);
  const Wide here = floor(place);
  const auto bits = [&](const Wide& at) {
    return noise.lattice_bits(Noise::to_bits(if_greater(pieces, at, row, later)),
                              Noise::to_bits(if_greater(pieces, at, at, at - pieces)));
  };
  const StrandBlendLanes<N> blend(place - here);
  const Bits a = bits(here);
  const Bits b = bits(here + one);
  const Wide slope = Wide(strand_edge_slope) * (Wide(2) * (strand - own) - one) +
                     Wide(strand_slope_across_rms) * blend.noise(a, b, 0);
  const Wide some = abs(sense);
  return {sense * slope, some * Wide(strand_slope_along_rms) * blend.noise(a, b, 1),
          sense * Wide(strand_fibre_turn_rms) * blend.noise(a, b, 2),
          some * Wide::load(&curves.contrast[i]) * blend.noise(a, b, 3),
          (one + Wide::load(&curves.irregularity[i]) * colour) * if_greater(some, Wide(0), shade, one)};
}

/// A place on the curve's axis, its direction there, and the way from it to the hit.
template <std::size_t N>
struct NearestPoint {
  WideFloat<N> fraction;
  WideVec3<N> tangent;
  WideVec3<N> axis_offset;
};

/// The nearest point of the cubic curve, as Yarns::point_at() has it.
template <std::size_t N>
SELVEDGE_INLINE NearestPoint<N> nearest_on_curve(const SegmentLanes<N>& s, const WideVec3<N>& from_start) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  const Vec& along = s.along;
  const Wide& inverse = s.inverse_length2;
  const Wide length = sqrt(Wide(1) / inverse);
  const Vec first = s.tangent[0] * length;
  const Vec second = s.tangent[1] * length;
  NearestPoint<N> at;
  for (int step = 0; step < 2; ++step) {
    const Wide next = step == 0 ? from_start.dot(along) * inverse
                                : at.fraction + at.axis_offset.dot(at.tangent) / at.tangent.dot(at.tangent);
    at.fraction = max(Wide(-0.25F), min(Wide(1.25F), next));
    const Wide& fraction = at.fraction;
    const Wide rest = Wide(1) - fraction;
    at.tangent = along * (Wide(6) * fraction * rest) + first * (rest * (Wide(1) - Wide(3) * fraction)) +
                 second * (fraction * (Wide(3) * fraction - Wide(2)));
    at.axis_offset = from_start - along * (fraction * fraction * (Wide(3) - Wide(2) * fraction)) -
                     first * (fraction * rest * rest) + second * (fraction * fraction * rest);
  }
  at.tangent = unit(at.tangent);
  return at;
}

/// Gloss of width r along x and 1 along y (yarn_reflectance.h), without its weight; 0 below the horizon.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> gloss_reflectance_lanes(const WideVec3<N>& l, const WideVec3<N>& v,
                                                     const WideFloat<N>& roughness) {
  using Wide = WideFloat<N>;
  const Wide one(1);
  const Wide r = max(Wide(static_cast<float>(min_gloss_width)), roughness);
  const Wide r2 = r * r;
  const auto masking = [&](const WideVec3<N>& d) {
    return (sqrt(one + (r2 * d.x * d.x + d.y * d.y) / (d.z * d.z)) - one) * Wide(0.5F);
  };
  const WideVec3<N> h = l + v;
  const Wide q = (h.x * h.x / r2 + h.y * h.y + h.z * h.z) / h.dot(h);
  return one /
         (Wide(4 * std::numbers::pi_v<float>) * r * q * q * (one + masking(l) + masking(v)) * l.z * v.z);
}

/// The body of yarn (yarn_reflectance.h), as a multiple of what matt yarn reflects.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> body_factor(const WideFloat<N>& light_along, const WideFloat<N>& view_along,
                                         const WideFloat<N>& lustre) {
  using Wide = WideFloat<N>;
  const Wide s2 = lustre * lustre;
  const Wide rest = Wide(1) - s2;
  return rest / (rest * rest + Wide(4) * lustre * (Wide(1) + s2) * light_along * view_along +
                 Wide(4) * s2 * (light_along * light_along + view_along * view_along));
}

}  // namespace selvedge
