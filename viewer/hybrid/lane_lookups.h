// Lookups of directions in a fabric's tables for sixteen pixels at once: what all texels of these pixels
// share. To be included by code for the lanes (format/simd).
#pragma once

#include <cstddef>
#include <limits>

#include "viewer/hybrid/evaluate_lanes.h"
#include "viewer/hybrid/fetch.h"
#include "viewer/hybrid/wide_directions.h"

namespace selvedge {

/// Number of lights whose lookups are computed together.
inline constexpr std::size_t lights_at_once = 8;

/// Inputs that all texels share.
struct SharedInputs {
  const PackedFabric& fabric;
  const LaneDirections& view;
  std::span<const LaneLight> lights;
  float* view_functions;   ///< [a - 1][lane]
  float* light_functions;  ///< [light][b][channel, 0][lane]
  float* rows;             ///< memory for lookups, [lane][number]
};

template <std::size_t N>
SELVEDGE_INLINE WideVec3<N> load(const LaneDirections& d, std::size_t first) {
  using Wide = WideFloat<N>;
  return {Wide::load(&d.x[first]), Wide::load(&d.y[first]), Wide::load(&d.z[first])};
}

/// The weighted sum of the four groups of a lookup.
template <std::size_t N>
SELVEDGE_INLINE void look_up(const Group* const* from, const WideTaps<N>& taps, WideFloat<N>* sum) {
  for (std::size_t tap = 0; tap < 4; ++tap) {
    const Group* moved[N];  // NOLINT(modernize-avoid-c-arrays)
    for (std::size_t lane = 0; lane < N; ++lane) moved[lane] = from[lane] + taps.cell[tap][lane];
    WideFloat<N> group[4];  // NOLINT(modernize-avoid-c-arrays)
    fetch<N>(moved, 0, group);
    for (std::size_t k = 0; k < 4; ++k)
      sum[k] = tap == 0 ? group[k] * taps.weight[tap] : sum[k] + group[k] * taps.weight[tap];
  }
}

template <std::size_t N>
SELVEDGE_INLINE WideFloat<N> clamp_to_finite(const WideFloat<N>& x) {
  return min(x, WideFloat<N>(std::numeric_limits<float>::max()));
}

/// The weighted sums of rows of `stride` numbers, a multiple of 16, at the four cells of each lane;
/// transposed, group k of lane i being at to[(4 k + member) * lane_count + i], for `groups` groups.
template <std::size_t N>
SELVEDGE_INLINE void look_up_rows(const float* rows, std::size_t stride, const WideTaps<N>& taps,
                                  std::size_t groups, float* scratch, float* to) {
  using Wide = WideFloat<N>;
  float weight[4][N];     // NOLINT(modernize-avoid-c-arrays)
  const Group* lanes[N];  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t tap = 0; tap < 4; ++tap) taps.weight[tap].store(weight[tap]);
  for (std::size_t lane = 0; lane < N; ++lane) {
    float* sum = scratch + lane * stride;
    lanes[lane] = reinterpret_cast<const Group*>(sum);
    const auto row = [&](std::size_t tap) { return rows + taps.cell[tap][lane] * stride; };
    for (std::size_t k = 0; k < stride; k += N) {
      const auto part = [&](std::size_t tap) __attribute__((always_inline)) {
        return Wide::load(row(tap) + k) * Wide(weight[tap][lane]);
      };
      (part(0) + part(1) + part(2) + part(3)).store(sum + k);
    }
  }
  for (std::size_t k = 0; k < groups; ++k) {
    Wide group[4];  // NOLINT(modernize-avoid-c-arrays)
    fetch<N>(lanes, k, group);
    for (std::size_t member = 0; member < 4; ++member)
      group[member].store(to + (4 * k + member) * lane_count);
  }
}

/// Lookups for one set of directions, which all texels of a fabric share.
template <std::size_t N>
struct Lookups {
  WideTaps<N> view;
  WideTaps<N> light[lights_at_once];  // NOLINT(modernize-avoid-c-arrays)
};

template <std::size_t N>
SELVEDGE_INLINE void fill(const SharedInputs& s, std::size_t first, Lookups<N>& lookups) {
  if (s.fabric.needs_views) {
    wide_interpolate<N>(s.fabric.fabric->views, load<N>(s.view, first), lookups.view);
    if (s.fabric.view_functions > 0) {
      look_up_rows<N>(s.fabric.view_basis.data(), s.fabric.view_stride, lookups.view,
                      (s.fabric.view_functions + 3) / 4, s.rows, s.view_functions + first);
    }
  }
  if (!s.fabric.needs_lights) return;
  for (std::size_t i = 0; i < s.lights.size(); ++i) {
    wide_interpolate<N>(s.fabric.fabric->lights, load<N>(s.lights[i].direction, first), lookups.light[i]);
    if (s.fabric.light_functions == 0) continue;
    const std::size_t groups = s.fabric.light_stride;
    look_up_rows<N>(s.fabric.light_basis.data()->data(), 4 * groups, lookups.light[i],
                    s.fabric.light_functions, s.rows,
                    s.light_functions + i * s.fabric.light_functions * 4 * lane_count + first);
  }
}

/// Storage for lookups of any width.
struct AllLookups {
  alignas(64) std::array<std::byte, lane_count / 4 * sizeof(Lookups<4>)> bytes;
};
static_assert(sizeof(Lookups<16>) <= sizeof(AllLookups) && sizeof(Lookups<8>) * 2 <= sizeof(AllLookups));

}  // namespace selvedge
