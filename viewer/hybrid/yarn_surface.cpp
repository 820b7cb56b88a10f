#include "viewer/hybrid/yarn_surface.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "format/fabric/lifted.h"
#include "format/fabric/yarn_sky.h"
#include "viewer/hybrid/fetch.h"
#include "viewer/hybrid/wide_directions.h"

namespace selvedge {
namespace {

using Floats = YarnSurface::Floats;

template <std::size_t N>
SELVEDGE_INLINE WideVec3<N> load(const YarnLanes& v, std::size_t first) {
  return {WideFloat<N>::load(&v.x[first]), WideFloat<N>::load(&v.y[first]), WideFloat<N>::load(&v.z[first])};
}

template <std::size_t N>
SELVEDGE_INLINE void store(const WideVec3<N>& v, YarnLanes& to, std::size_t first) {
  v.x.store(&to.x[first]);
  v.y.store(&to.y[first]);
  v.z.store(&to.z[first]);
}

template <std::size_t N>
SELVEDGE_INLINE WideVec3<N> unit(const WideVec3<N>& v) {
  return v * (WideFloat<N>(1) / sqrt(v.dot(v)));
}

template <std::size_t N>
SELVEDGE_INLINE WideVec3<N> lifted_lanes(const WideVec3<N>& d) {
  return unit(WideVec3<N>{d.x, d.y, max(d.z, WideFloat<N>(min_rise))});
}

/// Layout of a segment's lanes: groups of four floats, the members in their order.
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

// Strands at many points at once: the twin of format/fabric/yarn_strands.h, held to it by a test.

/// Strands that are not seen apart make their yarn so much darker, and the square of the highlight's width so
/// much larger: means over strands (spec/brdf.md, "Over a surface").
constexpr float hidden_loss = 0.06F;
constexpr float hidden_roughness2 = 0.05F;

/// Strands of the lanes' curves.
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

/// Of the curves of the lanes.
struct CurveLanes {
  alignas(64) Floats slope, stations;
  bool flat = false;  ///< whether one of them is
};

/// A place on the curve's axis, its direction there, and the way from it to the hit.
template <std::size_t N>
struct OnCurve {
  WideFloat<N> share;
  WideVec3<N> tangent;
  WideVec3<N> out;
};

/// The nearest point of the cubic curve, as Yarns::point_at() has it.
template <std::size_t N>
SELVEDGE_INLINE OnCurve<N> nearest_on_curve(const SegmentLanes<N>& s, const WideVec3<N>& from_start) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  const Vec& along = s.along;
  const Wide& inverse = s.inverse_length2;
  const Wide length = sqrt(Wide(1) / inverse);
  const Vec first = s.tangent[0] * length;
  const Vec second = s.tangent[1] * length;
  OnCurve<N> at;
  for (int step = 0; step < 2; ++step) {
    const Wide next = step == 0 ? from_start.dot(along) * inverse
                                : at.share + at.out.dot(at.tangent) / at.tangent.dot(at.tangent);
    at.share = max(Wide(-0.25F), min(Wide(1.25F), next));
    const Wide& share = at.share;
    const Wide rest = Wide(1) - share;
    at.tangent = along * (Wide(6) * share * rest) + first * (rest * (Wide(1) - Wide(3) * share)) +
                 second * (share * (Wide(3) * share - Wide(2)));
    at.out = from_start - along * (share * share * (Wide(3) - Wide(2) * share)) -
             first * (share * rest * rest) + second * (share * share * rest);
  }
  at.tangent = unit(at.tangent);
  return at;
}

template <std::size_t N>
SELVEDGE_INLINE void place_surface(const Group* const* segments, const CurveLanes& curves,
                                   const YarnLanes& from_start, YarnSurface& surface, Floats& station) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  for (std::size_t i = 0; i < yarn_lanes; i += N) {
    SegmentLanes<N> s(segments + i, curves.flat);
    const Vec off = load<N>(from_start, i);
    Vec round_off = off;
    if (curves.flat) {
      round_off = s.squeezed(off);
      s.along = s.squeezed(s.along);
      for (Vec& tangent : s.tangent) tangent = s.squeezed(tangent);
    }
    const OnCurve<N> at = nearest_on_curve<N>(s, round_off);
    const Wide zero(0);
    const Wide along = s.station + at.share * s.stations;
    if_greater(zero, along, along + Wide::load(&curves.stations[i]), along).store(&station[i]);
    const Vec round = unit(at.out - at.tangent * at.tangent.dot(at.out));
    const Vec around = at.tangent.cross(round);
    const Vec across = s.across[0] + (s.across[1] - s.across[0]) * at.share;
    const Wide cosine = round.dot(across);
    const Wide sine = -around.dot(across);
    const Wide norm2 = cosine * cosine + sine * sine;
    // A hair has what it has at its root.
    const auto or_root = [&](const Wide& a, const Wide& b) { return if_greater(s.stations, zero, a, b); };
    const Wide scale = Wide(1) / sqrt(norm2);
    const Vec fibre = at.tangent + around * or_root(Wide::load(&curves.slope[i]), zero);
    const Vec normal = curves.flat ? unit(s.squeezed(round)) : round;
    store(normal, surface.normal, i);
    store(s.start + off + normal * (s.radius * Wide(leave_radii)), surface.leave, i);
    store(unit(curves.flat ? s.stretched(fibre) : fibre), surface.fibre, i);
    or_root(if_greater(norm2, zero, cosine * scale, Wide(1)), s.across[0].x).store(&surface.cosine[i]);
    or_root(if_greater(norm2, zero, sine * scale, zero), s.across[0].y).store(&surface.sine[i]);
    or_root(round.dot(s.out[0] + (s.out[1] - s.out[0]) * at.share), s.across[0].z).store(&surface.outward[i]);
  }
}
SELVEDGE_THREE_BODIES(place_surface,
                      (const Group* const* segments, const CurveLanes& curves, const YarnLanes& from_start,
                       YarnSurface& surface, Floats& station),
                      (segments, curves, from_start, surface, station))

/// Turns normals and fibres to the visible strands', and changes the albedo; the indirect light
/// has the same change.
template <std::size_t N>
SELVEDGE_INLINE void turn_to_strands(const StrandCurves& strands, const CurveLanes& curves,
                                     const Floats& station, const YarnLanes& view, const Floats& spacing,
                                     YarnSurface& surface, Floats& brightness) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  const Wide zero(0);
  const Wide one(1);
  for (std::size_t i = 0; i < yarn_lanes; i += N) {
    const auto load_at = [&](const Floats& of) { return Wide::load(&of[i]); };
    const auto change = strand_change_lanes<N>(strands, i, load_at(surface.cosine), load_at(surface.sine),
                                               load_at(station) / load_at(curves.stations));
    const Vec smooth = load<N>(surface.normal, i);
    const Wide some = abs(load_at(strands.sense_x));
    const Wide shown = if_greater(
        some, zero, min(one, load_at(strands.width) / max(load_at(spacing) * Wide(2), Wide(1e-9F))), one);
    const Wide hidden = one - shown * shown;
    const Wide roughness = load_at(surface.roughness);
    sqrt(roughness * roughness + hidden * Wide(hidden_roughness2)).store(&surface.roughness[i]);
    const Vec fibre = load<N>(surface.fibre, i);
    const Vec across = fibre.cross(smooth);
    const Vec v = lifted_lanes(load<N>(view, i));
    Vec normal = unit(smooth + across * (change.across * shown) + fibre * (change.along * shown));
    normal = unit(normal + v * (shown * max(zero, Wide(min_strand_facing) - normal.dot(v))));
    const Vec turned = fibre + across * (change.turn * shown);
    const Vec along = unit(turned - normal * turned.dot(normal));
    const auto store_where = [&](const Vec& with, const Vec& without, YarnLanes& to) {
      store(Vec{if_greater(some, zero, with.x, without.x), if_greater(some, zero, with.y, without.y),
                if_greater(some, zero, with.z, without.z)},
            to, i);
    };
    store_where(normal, smooth, surface.normal);
    store_where(along, fibre, surface.fibre);
    const Wide bright = change.colour * (one + change.shade * shown);
    bright.store(&brightness[i]);
    const Wide most = (one - load_at(surface.gloss)) * Wide(std::numbers::inv_pi_v<float>);
    const Vec matt = load<N>(surface.matt, i) * bright;
    const Wide less = one - hidden * Wide(hidden_loss);
    store(Vec{min(matt.x, most), min(matt.y, most), min(matt.z, most)} * less, surface.matt, i);
  }
}
SELVEDGE_THREE_BODIES(turn_to_strands,
                      (const StrandCurves& strands, const CurveLanes& curves, const Floats& station,
                       const YarnLanes& view, const Floats& spacing, YarnSurface& surface,
                       Floats& brightness),
                      (strands, curves, station, view, spacing, surface, brightness))

/// Adds the two stations that lanes lie between, by the lanes' weights; times 1 + groove x outward.
template <std::size_t N>
SELVEDGE_INLINE void add_stations(const float* here, const float* next, const Floats& here_weight,
                                  const Floats& next_weight, const V3f& groove, const YarnSurface& surface,
                                  YarnSurface::Factors& factors) {
  using Wide = WideFloat<N>;
  constexpr std::size_t count = std::tuple_size_v<LightTransfer>;
  for (std::size_t i = 0; i < yarn_lanes; i += N) {
    const Wide c = Wide::load(&surface.cosine[i]);
    const Wide s = Wide::load(&surface.sine[i]);
    const Wide a = Wide::load(&here_weight[i]);
    const Wide b = Wide::load(&next_weight[i]);
    const Wide angle[angle_functions] = {Wide(1), c, s, c * c - s * s, Wide(2) * c * s};  // NOLINT
    Wide of_here[angle_functions];                                                        // NOLINT
    Wide of_next[angle_functions];                                                        // NOLINT
    for (int k = 0; k < angle_functions; ++k) {
      of_here[k] = a * angle[k];
      of_next[k] = b * angle[k];
    }
    const Wide outward = Wide::load(&surface.outward[i]);
    const Wide scale[3] = {Wide(1) + Wide(groove.x) * outward, Wide(1) + Wide(groove.y) * outward,  // NOLINT
                           Wide(1) + Wide(groove.z) * outward};
    for (std::size_t j = 0; j < count; ++j) {
      Wide sum(0);
      for (int k = 0; k < angle_functions; ++k)
        sum += of_here[k] * Wide(here[k * count + j]) + of_next[k] * Wide(next[k * count + j]);
      (Wide::load(&factors[j][i]) + scale[j % 3] * sum).store(&factors[j][i]);
    }
  }
}
SELVEDGE_THREE_BODIES(add_stations,
                      (const float* here, const float* next, const Floats& here_weight,
                       const Floats& next_weight, const V3f& groove, const YarnSurface& surface,
                       YarnSurface::Factors& factors),
                      (here, next, here_weight, next_weight, groove, surface, factors))

/// Gloss of width r along x and 1 along y (yarn_reflectance.h), without its weight; 0 below the horizon.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> gloss_of(const WideVec3<N>& l, const WideVec3<N>& v,
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

/// Indirect light of lanes i ..., by factors of the functions of the light d.
template <std::size_t N>
SELVEDGE_INLINE void store_indirect(const YarnSurface::Factors& factors, const WideVec3<N>& d, std::size_t i,
                                    YarnLanes& result) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  const Wide zero(0);
  const Wide one(1);
  const Wide basis[light_functions_of_yarn] = {
      // NOLINT(modernize-avoid-c-arrays)
      one, d.x, d.y, d.z, d.x * d.y, d.x * d.z, d.y * d.z, d.x * d.x - d.y * d.y, Wide(3) * d.z * d.z - one};
  Vec sum{zero, zero, zero};
  for (std::size_t k = 0; k < light_functions_of_yarn; ++k) {
    const auto of = [&](std::size_t colour) { return Wide::load(&factors[3 * k + colour][i]); };
    sum = sum + Vec{of(0), of(1), of(2)} * basis[k];
  }
  sum = sum * d.z;
  store(Vec{max(zero, sum.x), max(zero, sum.y), max(zero, sum.z)}, result, i);
}

template <std::size_t N>
SELVEDGE_INLINE void reflect_lanes(const YarnSurface& surface, const YarnLanes& light, const YarnLanes& view,
                                   YarnReflection& result) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  alignas(64) Floats sums;
  for (std::size_t i = 0; i < yarn_lanes; i += N) {
    const Vec d = load<N>(light, i);
    const Wide zero(0);
    const Wide one(1);
    store_indirect<N>(surface.transfer, d, i, result.indirect);

    const Vec normal = load<N>(surface.normal, i);
    const Vec l = lifted_lanes(d);
    const Wide cosine = normal.dot(l);
    Vec f = load<N>(surface.matt, i);
    if (surface.has_gloss) {
      Vec v = lifted_lanes(load<N>(view, i));
      v = unit(v + normal * max(zero, Wide(min_facing) - normal.dot(v)));
      const Vec fibre = load<N>(surface.fibre, i);
      const Vec across = normal.cross(fibre);
      const Vec local_light{l.dot(fibre), l.dot(across), cosine};
      const Vec local_view{v.dot(fibre), v.dot(across), v.dot(normal)};
      const Wide weight = Wide::load(&surface.gloss[i]);
      const Wide gloss = weight * gloss_of(local_light, local_view, Wide::load(&surface.roughness[i]));
      const Wide shown = if_greater(weight, zero, gloss, zero);
      f = f + Vec{shown, shown, shown};
    }
    // No step where the light sets.
    const Wide scale = cosine * min(one, d.z * Wide(1 / min_rise));
    const auto lit = [&](const Wide& value) { return if_greater(cosine, zero, value * scale, zero); };
    f = {lit(f.x), lit(f.y), lit(f.z)};
    store(f, result.direct, i);
    (f.x + f.y + f.z).store(&sums[i]);
  }
  // GCC 12 takes comparisons of 16 numbers apart where their bits are wanted.
  constexpr std::size_t part = std::min(N, std::size_t{8});
  result.facing = 0;
  for (std::size_t i = 0; i < yarn_lanes; i += part)
    result.facing |= bits_where_greater(WideFloat<part>::load(&sums[i]), WideFloat<part>(0)) << i;
}
SELVEDGE_THREE_BODIES(reflect_lanes,
                      (const YarnSurface& surface, const YarnLanes& light, const YarnLanes& view,
                       YarnReflection& result),
                      (surface, light, view, result))

template <std::size_t N>
SELVEDGE_INLINE void through_lanes(const YarnSurface& surface, const YarnLanes& light, YarnLanes& result) {
  for (std::size_t i = 0; i < yarn_lanes; i += N)
    store_indirect<N>(surface.through, load<N>(light, i), i, result);
}
SELVEDGE_THREE_BODIES(through_lanes, (const YarnSurface& surface, const YarnLanes& light, YarnLanes& result),
                      (surface, light, result))

}  // namespace

void find_surface(const Yarns& yarns, std::span<const float> sky, const YarnHits& hits, std::uint32_t lanes,
                  const YarnLanes& view, const YarnSurface::Floats& spacing, YarnSurface& surface) {
  static const auto place = place_surface_for_this_processor();
  static const auto turn = turn_to_strands_for_this_processor();
  static const auto add = add_stations_for_this_processor();
  const Yarns::Inside inside = yarns.inside();
  const YarnData& data = yarns.data();
  const auto first = static_cast<std::size_t>(std::countr_zero(lanes));
  std::array<const Group*, yarn_lanes> segments;
  std::array<int, yarn_lanes> of_curve;
  CurveLanes curves;
  StrandCurves strands;
  bool varies = false;
  surface.has_gloss = false;
  for (std::size_t i = 0; i < yarn_lanes; ++i) {
    const Yarns::Segment& s = inside.segments[hits.segment[(lanes >> i & 1) != 0 ? i : first]];
    segments[i] = reinterpret_cast<const Group*>(&s);
    of_curve[i] = s.curve;
    const YarnCurve& curve = data.curves[s.curve];
    curves.slope[i] = curve.fibre_slope;
    curves.flat |= curve.flattening != 1;
    curves.stations[i] = static_cast<float>(curve.stations);
    surface.matt.set(i, curve.albedo * ((1 - curve.gloss.weight) * std::numbers::inv_pi_v<float>));
    surface.gloss[i] = curve.gloss.weight;
    surface.roughness[i] = curve.gloss.roughness;
    surface.has_gloss |= curve.gloss.weight > 0;
    varies |= curve.strands.varies();
  }
  alignas(64) Floats station;
  place(segments.data(), curves, hits.from_start, surface, station);
  alignas(64) Floats brightness;
  brightness.fill(1);
  for (std::size_t i = 0; varies && i < yarn_lanes; ++i)
    strands.set(i, data, inside, reinterpret_cast<const Yarns::Segment&>(*segments[i]));
  if (varies) turn(strands, curves, station, view, spacing, surface, brightness);
  // Lanes between the same two stations have the same coefficients.
  surface.transfer = {};
  if (!data.through.empty()) surface.through = {};
  if (!sky.empty()) surface.sky = {};
  std::array<int, yarn_lanes> whole;
  for (std::size_t i = 0; i < yarn_lanes; ++i)
    whole[i] = (lanes >> i & 1) != 0 ? static_cast<int>(station[i]) : -1;
  for (std::uint32_t left = lanes; left != 0;) {
    const auto lead = static_cast<std::size_t>(std::countr_zero(left));
    alignas(64) Floats here{};
    alignas(64) Floats next{};
    for (std::size_t i = lead; i < yarn_lanes; ++i) {
      if (of_curve[i] != of_curve[lead] || whole[i] != whole[lead]) continue;
      next[i] = station[i] - static_cast<float>(whole[i]);
      here[i] = brightness[i] * (1 - next[i]);
      next[i] *= brightness[i];
      left &= ~(1U << i);
    }
    const auto place_of = [&](int number) {
      return std::size_t{light_values_per_station} *
             (inside.first_station[of_curve[lead]] + number % data.curves[of_curve[lead]].stations);
    };
    const std::size_t a = place_of(whole[lead]);
    const std::size_t b = place_of(whole[lead] + 1);
    const V3f& groove = data.curves[of_curve[lead]].plies.groove;
    add(&data.light[a], &data.light[b], here, next, groove, surface, surface.transfer);
    if (!data.through.empty())
      add(&data.through[a], &data.through[b], here, next, groove, surface, surface.through);
    if (!sky.empty()) add(&sky[a], &sky[b], here, next, V3f(sky_groove), surface, surface.sky);
  }
}

void reflect(const YarnSurface& surface, const YarnLanes& light, const YarnLanes& view,
             YarnReflection& result) {
  static const auto reflect_all = reflect_lanes_for_this_processor();
  reflect_all(surface, light, view, result);
}

void reflect_through(const YarnSurface& surface, const YarnLanes& light, YarnLanes& result) {
  static const auto reflect_all = through_lanes_for_this_processor();
  reflect_all(surface, light, result);
}

}  // namespace selvedge
