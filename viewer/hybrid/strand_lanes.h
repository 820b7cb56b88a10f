// Strands at many points at once: the fast twin of format/fabric/yarn_strands.h, held to it by a test.
#pragma once

#include "format/fabric/yarns.h"
#include "viewer/hybrid/wide_directions.h"

namespace selvedge {

/// Strands that are not seen apart make their yarn so much darker, and the square of the highlight's width so
/// much larger: means over strands (spec/brdf.md, "Over a surface").
inline constexpr float hidden_loss = 0.06F;
inline constexpr float hidden_roughness2 = 0.05F;

/// What the curves of the lanes say of their strands.
struct StrandCurves {
  using Floats = std::array<float, yarn_lanes>;
  alignas(64) Floats strands, shift, lays, pieces, irregularity, swells;
  alignas(64) Floats first_row, later_row;                 ///< StrandRows
  alignas(64) Floats width;                                ///< of a strand, mm
  alignas(64) Floats sense_x, sense_y;                     ///< Yarns::Inside::strand_sense; 0: no strands
  alignas(64) std::array<std::uint32_t, yarn_lanes> seed;  ///< hashed
  void set(std::size_t lane, const YarnData& data, const Yarns::Inside& inside,
           const Yarns::Segment& segment) {
    const YarnStrands& of = data.curves[segment.curve].strands;
    const V2f& sense = inside.strand_sense[segment.curve];
    const bool some = of.count != 0 && !(segment.rank > 0);
    strands[lane] = static_cast<float>(some ? std::abs(of.count) : 1);
    shift[lane] = some ? static_cast<float>(shift_within_turn(of)) : 0;
    lays[lane] = static_cast<float>(of.shift) / strands[lane];
    pieces[lane] = static_cast<float>(of.pieces);
    first_row[lane] = static_cast<float>(segment.rows.first);
    later_row[lane] = static_cast<float>(segment.rows.later);
    width[lane] = 2 * std::numbers::pi_v<float> * segment.wide(segment.radius) / strands[lane];
    irregularity[lane] = of.irregularity;
    swells[lane] = static_cast<float>(of.swells);
    sense_x[lane] = some ? sense.x : 0;
    sense_y[lane] = some ? sense.y : 0;
    seed[lane] = strand_hash(static_cast<std::uint32_t>(of.seed));
  }
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

  static SELVEDGE_INLINE Bits bits_of(const Wide& whole) { return (Bits)(whole.v + 8388608.0F) & 0x7fffffU; }
  static SELVEDGE_INLINE Wide number_of(const Bits& bits) {
    return Wide((Floats)(bits | 0x4b000000U)) - Wide(8388608.0F);
  }
  SELVEDGE_INLINE Bits at(const Bits& row, const Bits& place) const {
    Bits x = seed ^ (row << 16 | place);
    x = (x ^ x >> 16) * 0x7feb352dU;
    x = (x ^ x >> 15) * 0x846ca68bU;
    return x ^ x >> 16;
  }
  SELVEDGE_INLINE Wide offset(const Wide& row) const {
    return number_of(at(bits_of(row), Bits{} + place_of_offset) >> 9) * Wide(0x1p-23F);
  }
  static SELVEDGE_INLINE Wide value(const Bits& bits, int k) {
    return (number_of(bits >> 8 * k & 255U) - Wide(127.5F)) * Wide(0.013531648F);
  }
};

template <std::size_t N>
struct StrandBlendLanes {
  WideFloat<N> here, next;
  SELVEDGE_INLINE explicit StrandBlendLanes(const WideFloat<N>& part) {
    const WideFloat<N> one(1);
    const WideFloat<N> smooth = part * part * (WideFloat<N>(3) - WideFloat<N>(2) * part);
    const WideFloat<N> scale = one / sqrt(smooth * smooth + (one - smooth) * (one - smooth));
    here = (one - smooth) * scale;
    next = smooth * scale;
  }
  SELVEDGE_INLINE WideFloat<N> noise(const typename Lanes<N>::Bits& a, const typename Lanes<N>::Bits& b,
                                     int k) const {
    return here * StrandNoiseLanes<N>::value(a, k) + next * StrandNoiseLanes<N>::value(b, k);
  }
};

template <std::size_t N>
struct StrandChangeLanes {
  WideFloat<N> across, along, turn;
  WideFloat<N> shade;   ///< relative change of the albedo
  WideFloat<N> colour;  ///< factor of the albedo, of the yarn's irregularity
};

/// strand_change() of the lanes from i on, at the angle and share of the chain that lie there.
template <std::size_t N>
SELVEDGE_INLINE StrandChangeLanes<N> strand_change_lanes(const StrandCurves& curves, std::size_t i,
                                                         const WideFloat<N>& cosine, const WideFloat<N>& sine,
                                                         WideFloat<N> share) {
  using Wide = WideFloat<N>;
  using Noise = StrandNoiseLanes<N>;
  using Bits = typename Lanes<N>::Bits;
  const Wide zero(0);
  const Wide one(1);
  Noise noise;
  std::memcpy(&noise.seed, &curves.seed[i], sizeof noise.seed);
  share = share - floor(share);

  const Wide swells = Wide::load(&curves.swells[i]);
  const Wide swell = share * swells;
  const Wide first = min(floor(swell), swells - one);
  const Wide second = if_greater(swells, first + one, first + one, zero);
  const Bits yarn = Bits{} + row_of_yarn;
  const StrandBlendLanes<N> of_swell(swell - first);
  const Wide colour =
      of_swell.noise(noise.at(yarn, Noise::bits_of(first)), noise.at(yarn, Noise::bits_of(second)), 3);

  const Wide sense_x = Wide::load(&curves.sense_x[i]);
  const Wide sense_y = Wide::load(&curves.sense_y[i]);
  const Wide sense = sense_x * sense_y;
  const Wide strands = Wide::load(&curves.strands[i]);
  Wide turns = wide_turns<N>(sense_x * cosine, sense_y * sine) - Wide::load(&curves.lays[i]) * share;
  turns = turns - floor(turns);
  const Wide strand = turns * strands;
  const Wide own = min(floor(strand), strands - one);
  const Wide row = own + Wide::load(&curves.first_row[i]);
  Wide later = own + Wide::load(&curves.shift[i]);
  later = if_greater(strands, later, later, later - strands) + Wide::load(&curves.later_row[i]);
  const Wide pieces = Wide::load(&curves.pieces[i]);
  const Wide offset = noise.offset(row);
  const Wide place = share * pieces + offset + share * (noise.offset(later) - offset);
  const Wide here = floor(place);
  const auto bits = [&](const Wide& at) {
    return noise.at(Noise::bits_of(if_greater(pieces, at, row, later)),
                    Noise::bits_of(if_greater(pieces, at, at, at - pieces)));
  };
  const StrandBlendLanes<N> blend(place - here);
  const Bits a = bits(here);
  const Bits b = bits(here + one);
  const Wide slope =
      Wide(strand_roundness) * (Wide(2) * (strand - own) - one) + Wide(strand_tilt) * blend.noise(a, b, 0);
  const Wide some = abs(sense);
  return {sense * slope, some * Wide(strand_lift) * blend.noise(a, b, 1),
          sense * Wide(strand_sway) * blend.noise(a, b, 2), some * Wide(strand_shade) * blend.noise(a, b, 3),
          one + Wide::load(&curves.irregularity[i]) * colour};
}

}  // namespace selvedge
