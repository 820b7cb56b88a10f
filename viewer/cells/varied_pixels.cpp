#include "viewer/cells/varied_pixels.h"

#include "format/cells/surface_lanes.h"

namespace selvedge {
namespace {

template <std::size_t N>
struct LatticeLanes {
  typename Lanes<N>::Bits whole;
  WideFloat<N> part;

  /// `within`, of [0, 2^23), on from `first`.
  SELVEDGE_INLINE LatticeLanes(const typename Lanes<N>::Bits& first, const WideFloat<N>& within) {
    const WideFloat<N> floored = floor(within);
    whole = first + StrandNoiseLanes<N>::to_bits(floored);
    part = within - floored;
  }
  SELVEDGE_INLINE LatticeLanes of_areas(int log2_size) const {
    using Ints = typename Lanes<N>::Ints;
    using Bits = typename Lanes<N>::Bits;
    LatticeLanes result = *this;
    result.whole = (Bits)((Ints)whole >> log2_size);
    const WideFloat<N> rest = StrandNoiseLanes<N>::to_float(whole & ((1U << log2_size) - 1));
    result.part = (rest + part) * WideFloat<N>(1 / static_cast<float>(1U << log2_size));
    return result;
  }
};

template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> lattice_noise(std::uint32_t key, const LatticeLanes<N>& row,
                                           const LatticeLanes<N>& length) {
  using Noise = StrandNoiseLanes<N>;
  using Bits = typename Lanes<N>::Bits;
  const StrandBlendLanes<N> across(row.part);
  const StrandBlendLanes<N> along(length.part);
  const auto of_row = [&](const Bits& number) __attribute__((always_inline)) {
    const Bits bits = Noise::hash(number + key) + length.whole;
    return along.noise(Noise::hash(bits), Noise::hash(bits + 1U), 0);
  };
  return across.current_weight * of_row(row.whole) + across.next_weight * of_row(row.whole + 1U);
}

/// Rows across, and lengths along an axis.
template <std::size_t N>
struct RunLanes {
  LatticeLanes<N> row, length;
};

template <std::size_t N>
SELVEDGE_INLINE RunLanes<N> run_lanes(const RowNoise& runs, std::size_t axis, const VariedPixels& pixels,
                                      std::size_t first) {
  using Wide = WideFloat<N>;
  using Bits = typename Lanes<N>::Bits;
  using Noise = StrandNoiseLanes<N>;
  Bits across;
  Bits along;
  const std::size_t lanes = 4 * first;
  std::memcpy(&across, reinterpret_cast<const char*>(axis == 0 ? &pixels.repeat_v : &pixels.repeat_u) + lanes,
              sizeof across);
  std::memcpy(&along, reinterpret_cast<const char*>(axis == 0 ? &pixels.repeat_u : &pixels.repeat_v) + lanes,
              sizeof along);
  const LaneFloats& within_across = axis == 0 ? pixels.v : pixels.u;
  const LaneFloats& within_along = axis == 0 ? pixels.u : pixels.v;
  const LatticeLanes<N> row(
      across * static_cast<std::uint32_t>(runs.rows),
      Wide::load(&within_across[first]) * Wide(static_cast<float>(runs.rows)) + Wide(runs.offset));
  const auto repeats = static_cast<std::uint32_t>(1U << runs.log2_repeats);
  using Ints = typename Lanes<N>::Ints;
  const LatticeLanes<N> length(
      (Bits)((Ints)along >> runs.log2_repeats) * static_cast<std::uint32_t>(runs.lengths),
      (Noise::to_float(along & (repeats - 1)) + Wide::load(&within_along[first])) *
          Wide(static_cast<float>(runs.lengths) / static_cast<float>(repeats)));
  return {row, length};
}

template <std::size_t N>
SELVEDGE_INLINE void place_lanes(const Variation& variation, const LaneFloats& fraction,
                                 VariedPixels& pixels) {
  using Wide = WideFloat<N>;
  for (std::size_t first = 0; first < lane_count; first += N) {
    Wide way[2];  // NOLINT(modernize-avoid-c-arrays)
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const RowNoise& runs = variation.row_offsets[axis];
      const RunLanes<N> at = run_lanes<N>(runs, axis, pixels, first);
      const std::uint32_t key =
          variation_key(variation.seed, first_row_offset_lattice + static_cast<std::uint32_t>(axis));
      way[axis] =
          Wide::load(&fraction[first]) * Wide(runs.amplitude) * lattice_noise<N>(key, at.row, at.length);
    }
    const auto move = [&](const Wide& by, LaneFloats& within, std::array<std::int32_t, lane_count>& repeat)
        __attribute__((always_inline)) {
      const Wide moved = Wide::load(&within[first]) + by;
      const Wide whole = floor(moved);
      (moved - whole).store(&within[first]);
      std::int32_t steps[N];  // NOLINT(modernize-avoid-c-arrays)
      store_whole(whole, steps);
      for (std::size_t k = 0; k < N; ++k) repeat[first + k] += steps[k];
    };
    move(way[0], pixels.v, pixels.repeat_v);
    move(way[1], pixels.u, pixels.repeat_u);
  }
}
SELVEDGE_THREE_BODIES(place_lanes,
                      (const Variation& variation, const LaneFloats& fraction, VariedPixels& pixels),
                      (variation, fraction, pixels))

template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> run_factor(const Variation& variation, std::size_t axis,
                                        const VariedPixels& pixels, std::size_t first) {
  using Wide = WideFloat<N>;
  const RowNoise& runs = variation.row_brightness[axis];
  if (!(runs.amplitude > 0)) return Wide(1);
  const auto [row, length] = run_lanes<N>(runs, axis, pixels, first);
  LatticeLanes<N> sharp = row;
  sharp.part =
      max(min((row.part - Wide(0.5F)) * Wide(1 / (2 * row_blend_half_width)) + Wide(0.5F), Wide(1)), Wide(0));
  const auto lattice = static_cast<std::uint32_t>(2 * axis);
  const Wide single = lattice_noise<N>(variation_key(variation.seed, lattice), sharp, length);
  const Wide area = lattice_noise<N>(variation_key(variation.seed, lattice + 1), row.of_areas(log2_area_rows),
                                     length.of_areas(log2_area_lengths));
  const Wide sum = Wide(runs.amplitude) *
                   (Wide::load(&pixels.fade[lattice][first]) * single +
                    Wide(area_amplitude_ratio) * Wide::load(&pixels.fade[lattice + 1][first]) * area);
  return max(min(Wide(1) + sum, Wide(2)), Wide(0));
}

template <std::size_t N>
SELVEDGE_INLINE void vary_lanes(const Variation& variation, const VariedPixels& pixels, LaneFloats& factors) {
  using Wide = WideFloat<N>;
  for (std::size_t first = 0; first < lane_count; first += N) {
    const Wide of_u = run_factor<N>(variation, 0, pixels, first);
    const Wide of_v = run_factor<N>(variation, 1, pixels, first);
    (of_u + Wide::load(&pixels.along_v[first]) * (of_v - of_u)).store(&factors[first]);
  }
}
SELVEDGE_THREE_BODIES(vary_lanes,
                      (const Variation& variation, const VariedPixels& pixels, LaneFloats& factors),
                      (variation, pixels, factors))

}  // namespace

void place_pixels(const Variation& variation, const LaneFloats& fraction, VariedPixels& pixels) {
  place_lanes_for_this_processor(variation, fraction, pixels);
}

void find_variation_factors(const Variation& variation, const VariedPixels& pixels, LaneFloats& factors) {
  vary_lanes_for_this_processor(variation, pixels, factors);
}

}  // namespace selvedge
