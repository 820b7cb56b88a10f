#include "format/cells/cell_shading.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/cells/surface_lanes.h"
#include "format/fabric/yarn_sky.h"

namespace selvedge {
namespace {

using Quad = Floats4;

constexpr std::size_t max_lanes = 16;

/// Numbers of lanes' curves.
struct CurveNumbers {
  using Floats = std::array<float, max_lanes>;
  alignas(64) Floats slope, stations, gloss, rough, lustre, matt_x, matt_y, matt_z;
  int curve = -1;                       ///< of all lanes, or -1
  std::array<int, max_lanes> curves{};  ///< of the lanes, and 1; 0: unset
};

void set_curve(const YarnCurve& curve, std::size_t i, CurveNumbers& numbers, StrandCurves& strands) {
  numbers.slope[i] = curve.fibre_slope;
  numbers.stations[i] = static_cast<float>(curve.stations);
  const V3f matt = curve.albedo * ((1 - curve.gloss.weight) * std::numbers::inv_pi_v<float>);
  numbers.matt_x[i] = matt.x;
  numbers.matt_y[i] = matt.y;
  numbers.matt_z[i] = matt.z;
  numbers.gloss[i] = curve.gloss.weight;
  numbers.rough[i] = curve.gloss.roughness;
  numbers.lustre[i] = curve.gloss.lustre;
  strands.pieces[i] = static_cast<float>(curve.strands.noise_pieces);
  strands.irregularity[i] = curve.strands.irregularity;
  strands.contrast[i] = curve.strands.contrast;
  const int plies = curve.plies.count;
  strands.marl[i] = plies > 1 ? curve.strands.marl : 0;
  strands.marl_per_row[i] =
      2 * strands.marl[i] / static_cast<float>(std::max(1, std::abs(curve.strands.count) * (plies - 1)));
  strands.swells[i] = static_cast<float>(curve.strands.swells);
  strands.seed[i] = hash32(static_cast<std::uint32_t>(curve.strands.seed));
}

using Two = float __attribute__((vector_size(8)));
SELVEDGE_INLINE Two two_at(const float* from) {
  Two result;
  std::memcpy(&result, from, sizeof result);
  return result;
}

/// Whether grids of the lamps show what an image does alone: so small a part of the yarn that no other image
/// is worth sharing them with.
bool has_own_shadows(const CellYarn& yarn, const CellSize& size) {
  constexpr float max_part = 0.25F;
  if (!yarn.has_large_cell() || size.is_whole()) return false;
  const V2f seen = image_period(yarn, size) * V2f(size.window_samples) / V2f(size.repeat_samples);
  return seen.x * seen.y < max_part * yarn.yarns().period().x * yarn.yarns().period().y;
}

/// Fraction of a lamp's light that reaches N points: percentage-closer filtering over 2 x 2 texels.
template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> visibility_of_lamp(const FrontLamp& lamp, const WideVec3<N>& p, float plane,
                                                const V2f& period) {
  using Wide = WideFloat<N>;
  const DepthGrid& grid = lamp.shadow->grid;
  const bool is_whole = grid.size.is_whole();
  const Wide above = p.z - Wide(plane);
  // The place in the grid, along one axis.
  const auto texel_of = [&](const Wide& place, int axis, int count) __attribute__((always_inline)) {
    const auto texels = static_cast<float>(grid.period[axis]);
    const Wide at = (place - above * Wide(lamp.slope[axis])) * Wide(texels / period[axis]) -
                    Wide(0.5F + static_cast<float>(grid.window_origin[axis]));
    // A whole grid goes on with its first texels.
    const float last = static_cast<float>(count - (is_whole ? 0 : 1)) - 1e-3F;
    return min(max(at - floor(at * Wide(1 / texels)) * Wide(texels), Wide(0)), Wide(last));
  };
  const Wide in_x = texel_of(p.x, 0, grid.width);
  const Wide in_y = texel_of(p.y, 1, grid.height);
  const Wide column = floor(in_x);
  const Wide row = floor(in_y);
  std::int32_t here[N];   // NOLINT(modernize-avoid-c-arrays): written as whole vectors
  std::int32_t below[N];  // NOLINT(modernize-avoid-c-arrays)
  const Wide next_row =
      if_greater(row + Wide(1.5F), Wide(static_cast<float>(grid.height)), Wide(0), row + Wide(1));
  const Wide stride(static_cast<float>(grid.stride));
  store_whole(row * stride + column, here);
  store_whole(next_row * stride + column, below);
  const float* const z = grid.z.data();
  Group around[N];         // NOLINT(modernize-avoid-c-arrays)
  const Group* groups[N];  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t i = 0; i < N; ++i) {
    const Quad two_rows = __builtin_shufflevector(two_at(z + here[i]), two_at(z + below[i]), 0, 1, 2, 3);
    std::memcpy(&around[i], &two_rows, sizeof two_rows);
    groups[i] = &around[i];
  }
  Wide depth[4];  // NOLINT(modernize-avoid-c-arrays)
  fetch<N>(groups, 0, depth);
  const auto lit = [&](std::size_t k) __attribute__((always_inline)) {
    return if_greater(depth[k], p.z, Wide(0), Wide(1));
  };
  const Wide part_x = in_x - column;
  const Wide part_y = in_y - row;
  const Wide upper = lit(0) + part_x * (lit(1) - lit(0));
  const Wide lower = lit(2) + part_x * (lit(3) - lit(2));
  return upper + part_y * (lower - upper);
}

template <class Floats>
SELVEDGE_INLINE Floats positive(const Floats& a) {
  return a > 0.0F ? a : Floats{};
}

/// A value as it is rounded: its last product is not fused with a sum that takes it (-ffp-contract=fast).
template <class Floats>
SELVEDGE_INLINE Floats unfused(const Floats& value) {
#if __has_builtin(__builtin_assoc_barrier)
  return __builtin_assoc_barrier(value);
#else
  return value;
#endif
}

/// Surface of the yarn at N points.
template <std::size_t N>
struct ShadedLanes {
  WideVec3<N> leave;           ///< mm
  WideVec3<N> smooth, normal;  ///< without and with strands
  WideVec3<N> fibre, side, local_view, matt;
  WideFloat<N> gloss, roughness, bright;
  WideFloat<N> lustre, root_lustre;  ///< of the lamps' own light; of light from the table, of hairs 0
  WideFloat<N> station, cosine, sine, outward, side_x, side_y;
  bool is_matt = true;
};

/// Points of one batch, from `first` on.
template <std::size_t N>
struct PointLanes {
  const Group* from[N];    // NOLINT(modernize-avoid-c-arrays)
  const Group* extra[N];   // NOLINT(modernize-avoid-c-arrays)
  std::int32_t curves[N];  // NOLINT(modernize-avoid-c-arrays)
  std::size_t first = 0, count = 0;

  SELVEDGE_INLINE PointLanes(const ShadingJob& job, const ShadingBatch& batch, std::size_t first_point,
                             CurveNumbers& numbers, StrandCurves& strands)
      : first(first_point), count(std::min(N, batch.count - first_point)) {
    bool same = true;
    for (std::size_t i = 0; i < N; ++i) {
      const std::int32_t piece = batch.piece[first + (i < count ? i : 0)];
      const Yarns::Segment& s = job.pieces.segment(piece);
      from[i] = reinterpret_cast<const Group*>(&s);
      extra[i] = job.pieces.strands[piece].data();
      curves[i] = s.curve;
      same &= s.curve == curves[0];
    }
    if (same && numbers.curve == curves[0]) return;
    const YarnData& data = job.yarn.yarns().data();
    for (std::size_t i = 0; i < N; ++i) {
      if (numbers.curves[i] == curves[i] + 1) continue;
      numbers.curves[i] = curves[i] + 1;
      set_curve(data.curves[curves[i]], i, numbers, strands);
    }
    numbers.curve = same ? curves[0] : -1;
  }
};

/// Strands at points whose surface is known but for them.
template <std::size_t N>
SELVEDGE_INLINE void add_strand_lanes(const ShadingJob& job, const PointLanes<N>& points,
                                      const CurveNumbers& numbers, StrandCurves& strands,
                                      const WideVec3<N>& viewer, ShadedLanes<N>& at) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  const Wide zero(0);
  const Wide one(1);
  const auto load_of = [&](const CurveNumbers::Floats& floats) __attribute__((always_inline)) {
    return Wide::load(floats.data());
  };
  Wide more[4];  // NOLINT(modernize-avoid-c-arrays)
  fetch<N>(points.extra, 1, more);
  const Wide some = abs(more[2]);
  const Wide shown = some * min(one, more[1] * Wide(1 / std::max(2 * job.sample_width, 1e-9F)));
  const Wide hidden = some * (one - shown * shown);
  more[0].store(strands.next_first_row.data());
  more[2].store(strands.sense_x.data());
  more[3].store(strands.sense_y.data());
  fetch<N>(points.extra, 0, more);
  more[0].store(strands.strands.data());
  more[1].store(strands.shift.data());
  more[2].store(strands.lays.data());
  more[3].store(strands.first_row.data());
  const StrandPerturbationLanes<N> change =
      strand_perturbation_lanes<N>(strands, 0, at.cosine, at.sine, at.station / load_of(numbers.stations));
  const Vec across = at.fibre.cross(at.smooth);
  at.normal = unit(at.smooth + across * (change.across * shown) + at.fibre * (change.along * shown));
  at.normal = unit(at.normal + viewer * (shown * max(zero, Wide(min_strand_facing) - at.normal.dot(viewer))));
  const Vec turned = at.fibre + across * (change.turn * shown);
  at.fibre = unit(turned - at.normal * turned.dot(at.normal));
  at.bright = change.colour * (one + change.shade * shown);
  at.gloss = load_of(numbers.gloss);
  const Wide rough = load_of(numbers.rough);
  at.roughness = sqrt(rough * rough + hidden * Wide(unresolved_roughness2));
  at.lustre = load_of(numbers.lustre) * (one - hidden * Wide(unresolved_lustre_loss));
  at.is_matt = !any_greater(at.lustre, zero);
  const Wide most = (one - at.gloss) * Wide(std::numbers::inv_pi_v<float>);
  const Wide less = one - hidden * Wide(unresolved_strand_loss);
  const auto matt_of = [&](const Wide& value) __attribute__((always_inline)) {
    return min(value * at.bright, most) * less;
  };
  at.matt = {matt_of(load_of(numbers.matt_x)), matt_of(load_of(numbers.matt_y)),
             matt_of(load_of(numbers.matt_z))};
}

template <std::size_t N>
SELVEDGE_INLINE ShadedLanes<N> surface_lanes(const ShadingJob& job, const ShadingBatch& batch,
                                             const PointLanes<N>& points, const CurveNumbers& numbers,
                                             StrandCurves& strands) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  const bool flat = job.yarn.has_flat_sections();
  SegmentLanes<N> s(points.from, flat);
  const Vec off{Wide::load(&batch.x[points.first]), Wide::load(&batch.y[points.first]),
                Wide::load(&batch.z[points.first])};
  Vec round_off = off;
  if (flat) {
    round_off = s.squeezed(off);
    s.along = s.squeezed(s.along);
    for (Vec& tangent : s.tangent) tangent = s.squeezed(tangent);
  }
  const NearestPoint<N> on = nearest_on_curve<N>(s, round_off);
  const Wide zero(0);
  const Wide one(1);
  ShadedLanes<N> at;
  at.leave = s.start + off;
  const Wide station = s.station + on.fraction * s.station_span;
  at.station = if_greater(zero, station, station + Wide::load(numbers.stations.data()), station);
  const Vec round = unit(on.axis_offset - on.tangent * on.tangent.dot(on.axis_offset));
  const Vec around = on.tangent.cross(round);
  const Vec across0 = s.across[0] + (s.across[1] - s.across[0]) * on.fraction;
  const Wide cosine = round.dot(across0);
  const Wide sine = -around.dot(across0);
  const Wide norm2 = cosine * cosine + sine * sine;
  const Wide scale = one / sqrt(norm2);
  // A hair has the angle of its root.
  const auto or_root = [&](const Wide& a, const Wide& b) __attribute__((always_inline)) {
    return if_greater(s.station_span, zero, a, b);
  };
  at.smooth = flat ? unit(s.squeezed(round)) : round;
  const Vec fibre = on.tangent + around * or_root(Wide::load(numbers.slope.data()), zero);
  at.fibre = unit(flat ? s.stretched(fibre) : fibre);
  at.cosine = or_root(if_greater(norm2, zero, cosine * scale, one), s.across[0].x);
  at.sine = or_root(if_greater(norm2, zero, sine * scale, zero), s.across[0].y);
  const Vec out_of_axis = s.axis_to_ply[0] + (s.axis_to_ply[1] - s.axis_to_ply[0]) * on.fraction;
  at.outward = or_root(round.dot(out_of_axis), s.across[0].z);
  at.side_x = or_root(out_of_axis.dot(across0), s.across[1].x);
  at.side_y = or_root(out_of_axis.dot(on.tangent.cross(across0)), s.across[1].y);
  const V3f to_viewer = clamp_rise(job.view.view);
  const Vec viewer{Wide(to_viewer.x), Wide(to_viewer.y), Wide(to_viewer.z)};
  add_strand_lanes<N>(job, points, numbers, strands, viewer, at);
  const Vec facing = unit(viewer + at.normal * max(zero, Wide(min_facing_cosine) - at.normal.dot(viewer)));
  at.side = at.normal.cross(at.fibre);
  at.local_view = {facing.dot(at.fibre), facing.dot(at.side), facing.dot(at.normal)};
  at.root_lustre = or_root(at.lustre, zero);
  return at;
}

/// Stores the colours of lanes: of lane 4 j + i in to[i][j].
template <std::size_t N>
SELVEDGE_INLINE void store_colours(const WideVec3<N>& rgb, Group (*to)[N / 4]) {
  const WideFloat<N> zero(0);
  const auto xz_low = interleave_lower(rgb.x.v, rgb.z.v);
  const auto xz_high = interleave_upper(rgb.x.v, rgb.z.v);
  const auto y_low = interleave_lower(rgb.y.v, zero.v);
  const auto y_high = interleave_upper(rgb.y.v, zero.v);
  WideFloat<N>(interleave_lower(xz_low, y_low)).store(to[0][0].data());
  WideFloat<N>(interleave_upper(xz_low, y_low)).store(to[1][0].data());
  WideFloat<N>(interleave_lower(xz_high, y_high)).store(to[2][0].data());
  WideFloat<N>(interleave_upper(xz_high, y_high)).store(to[3][0].data());
}

/// Adds the lamps' own light.
template <std::size_t N>
SELVEDGE_INLINE void add_direct(const ShadingJob& job, const ShadingBatch& batch, const PointLanes<N>& points,
                                const ShadedLanes<N>& at, Group* raw) {
  using Wide = WideFloat<N>;
  using Vec = WideVec3<N>;
  const Wide zero(0);
  const auto planes = static_cast<std::size_t>(job.view.plane_count);
  const auto add_lanes = [&](int plane, const Vec& sum) __attribute__((always_inline)) {
    Group colour[4][N / 4];  // NOLINT(modernize-avoid-c-arrays)
    store_colours(sum, colour);
    for (std::size_t i = 0; i < points.count; ++i)
      accumulate(group_lanes(colour[i % 4][i / 4]),
                 raw[std::size_t{batch.texel[points.first + i]} * planes + plane]);
  };
  const bool own_grids = has_own_shadows(job.yarn, job.view.size);
  const V2f period = own_grids ? image_period(job.yarn, job.view.size) : job.yarn.yarns().period();
  const Vec in_image = at.leave + Vec{Wide::load(&batch.shift_x[points.first]),
                                      Wide::load(&batch.shift_y[points.first]), zero};
  Vec sum{zero, zero, zero};
  for (const FrontLamp& lamp : job.lamps) {
    const Vec light{Wide(lamp.raised_direction.x), Wide(lamp.raised_direction.y),
                    Wide(lamp.raised_direction.z)};
    const Wide facing_light = at.normal.dot(light);
    if (!any_greater(facing_light, zero)) continue;
    const Wide along = light.dot(at.fibre);
    const Wide glint = if_greater(
        min(at.gloss, facing_light), zero,  // along the surface gloss_reflectance_lanes() may have no number
        at.gloss * gloss_reflectance_lanes(Vec{along, light.dot(at.side), facing_light}, at.local_view,
                                           at.roughness),
        zero);
    const Vec own = at.is_matt ? at.matt : at.matt * body_factor(along, at.local_view.x, at.lustre);
    Wide fraction = facing_light * Wide(lamp.horizon_fade);
    if (lamp.shadow != nullptr)
      fraction =
          fraction * visibility_of_lamp<N>(
                         lamp, (own_grids ? in_image : at.leave) + at.smooth * Wide(lamp.shadow->bias_mm),
                         job.yarn.reference_height(), period);
    fraction = if_greater(facing_light, zero, fraction, zero);
    const Vec direct =
        Vec{(own.x + glint) * Wide(lamp.irradiance.x), (own.y + glint) * Wide(lamp.irradiance.y),
            (own.z + glint) * Wide(lamp.irradiance.z)} *
        fraction;
    if (lamp.plane == 0)
      sum = sum + direct;
    else
      add_lanes(lamp.plane, direct);
  }
  add_lanes(0, sum);
}

/// Light from the table of as many slots from `slot` on as fit: the functions of the angle with their
/// factors, between the rows `a` and `b` of two stations.
template <class Floats>
SELVEDGE_INLINE Floats light_of_slots(const Group* a, const Group* b, float part,
                                      const std::array<float, angle_function_count>& factors,
                                      std::size_t columns, std::size_t slot) {
  Floats value{};
  for (int k = 0; k < angle_function_count; ++k) {
    Floats low;
    Floats high;
    std::memcpy(&low, &a[k * columns + slot], sizeof low);
    std::memcpy(&high, &b[k * columns + slot], sizeof high);
    const Floats mixed = low + part * (high - low);
    value += k == 0 ? mixed : mixed * factors[k];
  }
  return value;
}

/// Slots before the first that does not light the plane of its own number from the front.
std::size_t slots_in_order(std::span<const LightSlot> slots) {
  std::size_t count = 0;
  while (count < slots.size() && slots[count].source == LightSlot::front &&
         slots[count].plane == static_cast<int>(count))
    ++count;
  return count;
}

/// The light of a point from the coefficients of two stations, for every lamp in turn: fewer steps than by
/// tables where lamps are many.
template <std::size_t N>
SELVEDGE_INLINE void add_by_lamps(const ShadingJob& job, const float* a, const float* b, float part,
                                  const std::array<float, angle_function_count>& factors,
                                  const Quad& of_lamps, float bright, const V2f& view_and_lustre, Group* to) {
  using Wide = WideFloat<N>;
  constexpr std::size_t values = 3 * yarn_light_function_count;
  alignas(64) float light[32] = {};  // NOLINT(modernize-avoid-c-arrays)
  static_assert(values <= 32 && (angle_function_count - 1) * values + 32 <= light_values_per_station);
  for (std::size_t k = 0; k < angle_function_count; ++k) {
    const Wide factor(factors[k]);
    for (std::size_t i = 0; i < 32; i += N) {
      const Wide low = Wide::load(&a[k * values + i]);
      const Wide high = Wide::load(&b[k * values + i]);
      (Wide::load(&light[i]) + factor * (low + Wide(part) * (high - low))).store(&light[i]);
    }
  }
  if (view_and_lustre.y > 0) {
    std::array<float, light_moment_count> moments{};
    const float* const first = a + transfer_values_per_station;
    const float* const second = b + transfer_values_per_station;
    for (std::size_t i = 0; i < light_moment_count * angle_function_count; ++i)
      moments[i / angle_function_count] +=
          factors[i % angle_function_count] * (first[i] + part * (second[i] - first[i]));
    bright *= lustre_factor(view_and_lustre.x, view_and_lustre.y, moments[0], moments[1]);
  }
  const std::size_t lamps = job.slots.size();
  const std::size_t padded = job.lamp_basis.size() / values;
  for (std::size_t lamp = 0; lamp < lamps; lamp += N) {
    WideVec3<N> sum{Wide(0), Wide(0), Wide(0)};
    const float* function = &job.lamp_basis[lamp];
    for (std::size_t i = 0; i < values; i += 3) {
      sum.x = sum.x + Wide(light[i]) * Wide::load(function);
      sum.y = sum.y + Wide(light[i + 1]) * Wide::load(function + padded);
      sum.z = sum.z + Wide(light[i + 2]) * Wide::load(function + 2 * padded);
      function += 3 * padded;
    }
    const auto sent = [&](const Wide& value, int colour) __attribute__((always_inline)) {
      return max(value * Wide(of_lamps[colour]), Wide(0)) * Wide(bright);
    };
    Group colours[4][N / 4];  // NOLINT(modernize-avoid-c-arrays)
    store_colours(WideVec3<N>{sent(sum.x, 0), sent(sum.y, 1), sent(sum.z, 2)}, colours);
    for (std::size_t i = 0; i < std::min(N, lamps - lamp); ++i)
      accumulate(group_lanes(colours[i % 4][i / 4]), to[lamp + i]);
  }
}

/// Adds light from the table or the lamps' functions, and sets the opacity. `in_order`: slots_in_order().
template <std::size_t N>
SELVEDGE_INLINE void add_indirect(const ShadingJob& job, const ShadingBatch& batch,
                                  const PointLanes<N>& points, const ShadedLanes<N>& at, std::size_t in_order,
                                  Group* raw) {
  using Wide = WideFloat<N>;
  using Floats = typename Lanes<N>::Floats;
  const Wide whole = floor(at.station);
  alignas(64) float numbers[12][N];  // NOLINT(modernize-avoid-c-arrays)
  whole.store(numbers[0]);
  (at.station - whole).store(numbers[1]);
  at.cosine.store(numbers[2]);
  at.sine.store(numbers[3]);
  (at.cosine * at.cosine - at.sine * at.sine).store(numbers[4]);
  (Wide(2) * at.cosine * at.sine).store(numbers[5]);
  at.outward.store(numbers[6]);
  at.bright.store(numbers[7]);
  at.side_x.store(numbers[8]);
  at.side_y.store(numbers[9]);
  at.local_view.x.store(numbers[10]);
  at.root_lustre.store(numbers[11]);
  const std::size_t slots = job.slots.size();
  const std::size_t columns = slots + 1;
  const auto planes = static_cast<std::size_t>(job.view.plane_count);
  const YarnData& data = job.yarn.yarns().data();
  const std::span<const int> first_station = job.yarn.yarns().geometry().first_station;
  for (std::size_t i = 0; i < points.count; ++i) {
    const YarnCurve& curve = data.curves[points.curves[i]];
    int here = static_cast<int>(numbers[0][i]);
    if (here >= curve.stations) here -= curve.stations;
    const int next = here + 1 >= curve.stations ? 0 : here + 1;
    const int first = first_station[points.curves[i]];
    const V3f& groove = curve.plies.outward_gain;
    const Quad of_lamps = Quad{1, 1, 1, 0} + Quad{groove.x, groove.y, groove.z, 0} * numbers[6][i];
    Wide of_all_lamps;
    for (std::size_t k = 0; k < N; k += 4) std::memcpy((float*)&of_all_lamps + k, &of_lamps, sizeof of_lamps);
    const bool sides = curve.plies.sides != 0;
    const std::array<float, angle_function_count> factors{
        1, numbers[2][i], numbers[3][i], numbers[sides ? 8 : 4][i], numbers[sides ? 9 : 5][i]};
    Group* const to = raw + std::size_t{batch.texel[points.first + i]} * planes;
    (*to)[3] = 1;
    if (!job.view.has_station_table) {
      const bool behind = slots > 0 && job.slots.front().source == LightSlot::behind;
      const float* const light = (behind ? data.light_through : data.station_light).data();
      add_by_lamps<N>(job, &light[std::size_t{1} * (first + here) * light_values_per_station],
                      &light[std::size_t{1} * (first + next) * light_values_per_station], numbers[1][i],
                      factors, of_lamps, numbers[7][i], {numbers[10][i], behind ? 0 : numbers[11][i]}, to);
      continue;
    }
    const Group* a = &job.station_table[(first + here) * angle_function_count * columns];
    const Group* b = &job.station_table[(first + next) * angle_function_count * columns];
    float by_view = 1;
    if (numbers[11][i] > 0) {
      const Quad moments = light_of_slots<Quad>(a, b, numbers[1][i], factors, columns, slots);
      by_view = lustre_factor(numbers[10][i], numbers[11][i], moments[0], moments[1]);
    }
    std::size_t slot = 0;
    for (; slot + N / 4 <= in_order; slot += N / 4) {
      const Floats value =
          light_of_slots<Floats>(a, b, numbers[1][i], factors, columns, slot) * of_all_lamps.v;
      float* const values = to[slot].data();
      (Wide::load(values) + Wide(unfused(positive(value) * numbers[7][i] * by_view))).store(values);
    }
    for (; slot < slots; ++slot) {
      const auto from_side = job.slots[slot].source;
      Quad value = light_of_slots<Quad>(a, b, numbers[1][i], factors, columns, slot);
      if (from_side != LightSlot::sky) value *= of_lamps;
      value = positive(value) * numbers[7][i];
      if (from_side == LightSlot::front) value *= by_view;
      accumulate(value, to[job.slots[slot].plane]);
    }
  }
}

template <std::size_t N>
SELVEDGE_INLINE void shade_batch(const ShadingJob& job, const ShadingBatch& batch, Group* raw) {
  StrandCurves strands;
  CurveNumbers numbers;
  const std::size_t in_order = slots_in_order(job.slots);
  for (std::size_t first = 0; first < batch.count; first += N) {
    const PointLanes<N> points(job, batch, first, numbers, strands);
    const ShadedLanes<N> at = surface_lanes<N>(job, batch, points, numbers, strands);
    add_direct<N>(job, batch, points, at, raw);
    add_indirect<N>(job, batch, points, at, in_order, raw);
  }
}
SELVEDGE_THREE_BODIES(shade_batch, (const ShadingJob& job, const ShadingBatch& batch, Group* raw),
                      (job, batch, raw))

using LightBasis = std::array<V3f, yarn_light_function_count>;

/// Light of a station: for angle function i, the sum over light functions of c_ik B_k.
void set_slot(const float* coefficients, const LightBasis& basis, std::size_t columns, Group* to) {
  for (int row = 0; row < angle_function_count; ++row) {
    const float* const c = coefficients + row * 3 * yarn_light_function_count;
    Quad sum{};
    for (int k = 0; k < yarn_light_function_count; ++k)
      sum += Quad{c[3 * k] * basis[k].x, c[3 * k + 1] * basis[k].y, c[3 * k + 2] * basis[k].z, 0};
    std::memcpy(&to[row * columns], &sum, sizeof sum);
  }
}

struct LightSource {
  LightSlot slot;
  std::span<const float> coefficients;
  LightBasis basis;
};

std::vector<LightSource> light_sources(const CellYarn& yarn, const CellView& view) {
  const YarnData& data = yarn.yarns().data();
  std::vector<LightSource> sources;
  for (const CellLamp& lamp : view.lamps) {
    const bool behind = !(lamp.direction.z > 0);
    if (behind && (data.light_through.empty() || !(lamp.direction.z < 0))) continue;
    const std::array<float, yarn_light_function_count> basis =
        light_basis(V3f(lamp.direction.x, lamp.direction.y, std::abs(lamp.direction.z)));
    LightSource& source = sources.emplace_back();
    source.slot = {lamp.plane, behind ? LightSlot::behind : LightSlot::front};
    source.coefficients = behind ? data.light_through : data.station_light;
    for (int k = 0; k < yarn_light_function_count; ++k) source.basis[k] = lamp.irradiance * basis[k];
  }
  if (view.environment && !yarn.sky_transfer().empty())
    sources.push_back({{0, LightSlot::sky}, yarn.sky_transfer(), view.environment->coefficients});
  return sources;
}

}  // namespace

std::vector<LightSlot> light_slots(const CellYarn& yarn, const CellView& view) {
  std::vector<LightSlot> slots;
  for (const LightSource& source : light_sources(yarn, view)) slots.push_back(source.slot);
  return slots;
}

std::vector<float> light_basis_of_lamps(const CellYarn& yarn, const CellView& view) {
  const std::vector<LightSource> sources = light_sources(yarn, view);
  const std::size_t padded = (sources.size() + max_lanes - 1) / max_lanes * max_lanes;
  std::vector<float> functions(padded * 3 * yarn_light_function_count);
  for (std::size_t lamp = 0; lamp < sources.size(); ++lamp) {
    float* to = &functions[lamp];
    for (const V3f& value : sources[lamp].basis)
      for (int colour = 0; colour < 3; ++colour, to += padded) *to = value[colour];
  }
  return functions;
}

void fill_station_table(const CellYarn& yarn, const CellView& view,
                        const std::vector<std::uint32_t>* stations, std::vector<Group>& table) {
  const std::vector<LightSource> sources = light_sources(yarn, view);
  const std::size_t columns = sources.size() + 1;
  const std::vector<float>& light = yarn.yarns().data().station_light;
  const std::size_t count = light.size() / light_values_per_station;
  table.resize(count * angle_function_count * columns);
  for (std::size_t i = 0; i < (stations != nullptr ? stations->size() : count); ++i) {
    const std::size_t station = stations != nullptr ? (*stations)[i] : i;
    Group* const to = &table[station * angle_function_count * columns];
    const std::size_t first = station * light_values_per_station;
    for (std::size_t slot = 0; slot < sources.size(); ++slot)
      set_slot(&sources[slot].coefficients[first], sources[slot].basis, columns, to + slot);
    const float* const moments = &light[first + transfer_values_per_station];
    for (int row = 0; row < angle_function_count; ++row)
      to[row * columns + sources.size()] = {moments[row], moments[angle_function_count + row], 0, 0};
  }
}

std::vector<FrontLamp> make_front_lamps(const CellYarn& yarn, const CellView& view, float pixel,
                                        const V2f& heights, CellShadows& shadows) {
  const ShadowDetail detail{pixel / view.shadow_texels_per_pixel,
                            view.max_piece_pixels * std::min(view.shadow_texels_per_pixel, 1.0F),
                            view.shadow_texels_per_pixel / view.rays_per_pixel_side,
                            view.has_hairs && view.hair_shadows};
  const bool is_own = has_own_shadows(yarn, view.size) && heights.x <= heights.y;
  std::vector<FrontLamp> lamps;
  for (const CellLamp& lamp : view.lamps) {
    if (!(lamp.direction.z > 0)) continue;
    const auto shadow = is_own
                            ? shadows.cast(lamp.direction, detail, {view.size, ray_slope(view.view), heights})
                            : shadows.cast(lamp.direction, detail);
    lamps.push_back({clamp_rise(lamp.direction), lamp.irradiance,
                     std::min(1.0F, lamp.direction.z / min_ray_rise), lamp.plane, shadow->slope, shadow});
  }
  return lamps;
}

void shade(const ShadingJob& job, const ShadingBatch& batch, Group* raw) {
  // Lanes behind the last point read what earlier points left.
  if (batch.count > 0) shade_batch_for_this_processor(job, batch, raw);
}

}  // namespace selvedge
