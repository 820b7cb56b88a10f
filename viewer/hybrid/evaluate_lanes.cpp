#include "viewer/hybrid/evaluate_lanes.h"

#include <algorithm>
#include <limits>

#include "format/fabric/lafortune.h"
#include "viewer/hybrid/fetch.h"
#include "viewer/hybrid/wide_directions.h"

namespace selvedge {
namespace {

/// Number of lights whose lookups are computed together.
constexpr std::size_t lights_at_once = 8;
constexpr std::size_t max_lobes = 16;

/// Texels of one layout that are evaluated together: the data of each lane.
struct LaneBatch {
  explicit LaneBatch(const PackedLayout& layout_of_all) : layout(layout_of_all) {}

  const PackedLayout& layout;
  std::array<const Group*, lane_count> texel;   ///< its groups
  std::array<const Group*, lane_count> views;   ///< of its first view
  std::array<const Group*, lane_count> lights;  ///< of its first light
  std::array<const Group*, lane_count> coefficients;
  alignas(64) LaneFloats weight;
};

/// Inputs that all texels share.
struct SharedInputs {
  const PackedFabric& fabric;
  const LaneDirections& view;
  std::span<const LaneLight> lights;
  float* view_functions;   ///< [a - 1][lane]
  float* light_functions;  ///< [light][b][channel][lane]
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

/// phi_a(v) of all a, for lanes first ... first + N - 1.
template <std::size_t N>
SELVEDGE_INLINE void fill_view_functions(const SharedInputs& s, std::size_t first, const WideTaps<N>& taps) {
  const std::size_t count = s.fabric.view_functions;
  for (std::size_t a = 0; a < count; ++a) {
    WideFloat<N> sum(0);
    for (std::size_t tap = 0; tap < 4; ++tap) {
      float values[N];  // NOLINT(modernize-avoid-c-arrays)
      for (std::size_t lane = 0; lane < N; ++lane)
        values[lane] = s.fabric.view_basis[taps.cell[tap][lane] * count + a];
      sum += WideFloat<N>::load(values) * taps.weight[tap];
    }
    sum.store(s.view_functions + a * lane_count + first);
  }
}

/// psi_b(l) of all b and one light.
template <std::size_t N>
SELVEDGE_INLINE void fill_light_functions(const SharedInputs& s, std::size_t light, std::size_t first,
                                          const WideTaps<N>& taps) {
  const std::size_t count = s.fabric.light_functions;
  WideTaps<N> group_taps = taps;
  const Group* base[N];  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t tap = 0; tap < 4; ++tap) {
    for (std::size_t lane = 0; lane < N; ++lane) group_taps.cell[tap][lane] *= s.fabric.light_functions;
  }
  for (std::size_t b = 0; b < count; ++b) {
    for (std::size_t lane = 0; lane < N; ++lane) base[lane] = s.fabric.light_basis.data() + b;
    WideFloat<N> psi[4];  // NOLINT(modernize-avoid-c-arrays)
    look_up<N>(base, group_taps, psi);
    for (std::size_t c = 0; c < 3; ++c)
      psi[c].store(s.light_functions + ((light * count + b) * 3 + c) * lane_count + first);
  }
}

/// Sum over m of c_m phi_a(m) psi_b(m).
template <std::size_t N>
SELVEDGE_INLINE void add_products(const SharedInputs& s, const LaneBatch& batch, std::size_t light,
                                  std::size_t first, WideFloat<N>* sum) {
  using Wide = WideFloat<N>;
  const std::size_t functions = s.fabric.light_functions;
  const std::size_t count = batch.layout.products;
  Wide group[4];  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t m = 0; m < count; ++m) {
    if (m % 4 == 0) fetch<N>(batch.coefficients.data() + first, m / 4, group);
    const V2i& pair = batch.layout.pairs[m];
    Wide factor = group[m % 4];
    if (pair.x > 0) factor *= Wide::load(s.view_functions + (pair.x - 1) * lane_count + first);
    const float* psi = s.light_functions + (light * functions + pair.y) * 3 * lane_count + first;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += factor * Wide::load(psi + c * lane_count);
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
    fill_view_functions<N>(s, first, lookups.view);
  }
  if (!s.fabric.needs_lights) return;
  for (std::size_t i = 0; i < s.lights.size(); ++i) {
    wide_interpolate<N>(s.fabric.fabric->lights, load<N>(s.lights[i].direction, first), lookups.light[i]);
    fill_light_functions<N>(s, i, first, lookups.light[i]);
  }
}

/// Evaluates the texels of one batch; `with_alpha`: adds opacity as well. `Known` is the number of lobes if
/// it is known at compile time, else 0.
template <std::size_t N, int Known, class Power>
SELVEDGE_INLINE void evaluate(const SharedInputs& s, const LaneBatch& batch, const Lookups<N>& lookups,
                              std::size_t first, bool with_alpha, LaneShading& result) {
  using Wide = WideFloat<N>;
  const PackedLayout& layout = batch.layout;
  const Wide zero(0);
  const Wide one(1);
  const WideVec3<N> view = load<N>(s.view, first);

  // T and alpha.
  Wide table[4] = {one, one, one, one};  // NOLINT(modernize-avoid-c-arrays)
  if (layout.has_views) {
    look_up<N>(batch.views.data() + first, lookups.view, table);
    for (std::size_t c = 0; c < 3; ++c)
      table[c] = if_greater(table[3], zero, clamp_to_finite(table[c] / table[3]), zero);
    table[3] = min(table[3], one);
  }
  const Wide share = Wide::load(&batch.weight[first]) * table[3];

  // The texel's frame and lobes.
  const int lobes = Known > 0 ? Known : layout.lobes;
  const std::size_t per_channel = 1 + 4 * lobes;
  Wide parameters[3 * (1 + 4 * (Known > 0 ? Known : max_lobes))];  // NOLINT(modernize-avoid-c-arrays)
  Wide normal[4];                                                  // NOLINT(modernize-avoid-c-arrays)
  Wide tangent[4];                                                 // NOLINT(modernize-avoid-c-arrays)
  Wide last[4];                                                    // NOLINT(modernize-avoid-c-arrays)
  const Group* const* texel = batch.texel.data() + first;
  fetch<N>(texel, 0, normal);
  fetch<N>(texel, 1, tangent);
  fetch<N>(texel, 2, last);
  parameters[0] = normal[3];
  parameters[per_channel] = tangent[3];
  parameters[2 * per_channel] = last[0];
  for (std::size_t c = 0; c < 3; ++c) {
    for (int j = 0; j < lobes; ++j)
      fetch<N>(texel, 3 + c * lobes + j, parameters + c * per_channel + 1 + 4 * j);
  }
  const WideVec3<N> n{normal[0], normal[1], normal[2]};
  const WideVec3<N> t{tangent[0], tangent[1], tangent[2]};
  const WideVec3<N> b = n.cross(t);
  const Wide in_texel[3] = {view.dot(t), view.dot(b), view.dot(n)};  // NOLINT(modernize-avoid-c-arrays)

  Wide sum[3] = {zero, zero, zero};  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t i = 0; i < s.lights.size(); ++i) {
    const LaneLight& light = s.lights[i];
    const WideVec3<N> l = load<N>(light.direction, first);
    if (!any_greater(min(l.z, view.z), zero)) continue;
    const Wide irradiance = if_greater(min(l.z, view.z), zero, Wide::load(&light.share[first]), zero);
    Wide factor[3] = {table[0], table[1], table[2]};  // NOLINT(modernize-avoid-c-arrays)
    if (layout.has_lights) {
      Wide of_light[4];  // NOLINT(modernize-avoid-c-arrays)
      look_up<N>(batch.lights.data() + first, lookups.light[i], of_light);
      for (std::size_t c = 0; c < 3; ++c) factor[c] *= of_light[c];
    }
    if (layout.products > 0) {
      if (!layout.has_table) factor[0] = factor[1] = factor[2] = zero;
      add_products<N>(s, batch, i, first, factor);
    }
    if (layout.has_lights || layout.products > 0) {
      for (std::size_t c = 0; c < 3; ++c) factor[c] = clamp_to_finite(max(factor[c], zero));
    }
    const Wide to_light[3] = {l.dot(t), l.dot(b), l.dot(n)};  // NOLINT(modernize-avoid-c-arrays)
    const Wide cosine = max(to_light[2], zero);
#pragma GCC unroll 3
    for (std::size_t c = 0; c < 3; ++c) {
      const Wide bracket = lafortune_lobes(parameters + c * per_channel, lobes, to_light, in_texel, Power());
      factor[c] =
          clamp_to_finite(factor[c] * clamp_to_finite(if_greater(cosine, zero, bracket * cosine, zero)));
    }
    const Wide scale(s.fabric.fabric->radiance_scale);
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] +=
          clamp_to_finite(scale * factor[c]) * (irradiance * Wide(light.irradiance[static_cast<int>(c)]));
  }
  const auto add = [&](float* target, const Wide& value) __attribute__((always_inline)) {
    (Wide::load(target) + if_greater(share, zero, value, zero)).store(target);
  };
  add(&result.red[first], sum[0] * share);
  add(&result.green[first], sum[1] * share);
  add(&result.blue[first], sum[2] * share);
  if (with_alpha) add(&result.alpha[first], share);
}

/// The batch of the lanes of `group`, whose levels have one layout.
LaneBatch batch_of(const PackedFabric& fabric, const LaneTexels& texels, const PackedLayout& layout,
                   std::uint32_t group, std::size_t leader) {
  LaneBatch batch(layout);
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    // Inactive lanes repeat the leader's texel with weight 0.
    const bool active = (group >> lane & 1U) != 0;
    const std::size_t source = active ? lane : leader;
    const PackedLevel& level = fabric.levels[texels.level[source]];
    const std::size_t texel = texels.texel[source];
    batch.texel[lane] = level.texels.data() + texel * layout.texel_groups();
    if (layout.has_views) batch.views[lane] = level.views.data() + texel * fabric.fabric->views.count();
    if (layout.has_lights) batch.lights[lane] = level.lights.data() + texel * fabric.fabric->lights.count();
    if (layout.products > 0)
      batch.coefficients[lane] = level.coefficients.data() + texel * layout.coefficient_groups();
    batch.weight[lane] = active ? texels.weight[lane] : 0.0F;
  }
  return batch;
}

/// Calls body(batch) for batches that together hold all lanes of `texels`.
template <class Body>
void for_each_batch(const PackedFabric& fabric, const LaneTexels& texels, const Body& body) {
  const auto layout_of = [&](std::size_t lane) { return fabric.levels[texels.level[lane]].layout; };
  std::uint32_t remaining = 0;
  for (std::size_t lane = 0; lane < lane_count; ++lane)
    remaining |= (texels.weight[lane] > 0 ? 1U : 0U) << lane;
  while (remaining != 0) {
    const int leader = std::countr_zero(remaining);
    const int layout = layout_of(leader);
    std::uint32_t group = remaining;
    if (fabric.layouts.size() > 1) {
      for (std::size_t lane = 0; lane < lane_count; ++lane) {
        const bool other = (remaining >> lane & 1U) != 0 && layout_of(lane) != layout;
        group &= ~((other ? 1U : 0U) << lane);
      }
    }
    remaining &= ~group;
    body(batch_of(fabric, texels, fabric.layouts[layout], group, leader));
  }
}

/// Storage for lookups of any width.
struct AllLookups {
  alignas(64) std::array<std::byte, lane_count / 4 * sizeof(Lookups<4>)> bytes;
};
static_assert(sizeof(Lookups<16>) <= sizeof(AllLookups) && sizeof(Lookups<8>) * 2 <= sizeof(AllLookups));

template <std::size_t N>
SELVEDGE_INLINE void fill_all(const SharedInputs& s, AllLookups& lookups) {
  for (std::size_t i = 0; i < lane_count / N; ++i)
    fill<N>(s, i * N, reinterpret_cast<Lookups<N>*>(lookups.bytes.data())[i]);
}
SELVEDGE_THREE_BODIES(fill_all, (const SharedInputs& s, AllLookups& lookups), (s, lookups))

template <std::size_t N, class Power>
SELVEDGE_INLINE void evaluate_by(const SharedInputs& s, const LaneBatch& batch, const AllLookups& lookups,
                                 bool with_alpha, LaneShading& result) {
  for (std::size_t i = 0; i < lane_count / N; ++i) {
    const Lookups<N>& lane_lookups = reinterpret_cast<const Lookups<N>*>(lookups.bytes.data())[i];
    // The most frequent number of lobes.
    if (batch.layout.lobes == 2)
      evaluate<N, 2, Power>(s, batch, lane_lookups, i * N, with_alpha, result);
    else
      evaluate<N, 0, Power>(s, batch, lane_lookups, i * N, with_alpha, result);
  }
}
template <std::size_t N>
SELVEDGE_INLINE void evaluate_exact(const SharedInputs& s, const LaneBatch& batch, const AllLookups& lookups,
                                    bool with_alpha, LaneShading& result) {
  evaluate_by<N, PositivePower>(s, batch, lookups, with_alpha, result);
}
template <std::size_t N>
SELVEDGE_INLINE void evaluate_fast(const SharedInputs& s, const LaneBatch& batch, const AllLookups& lookups,
                                   bool with_alpha, LaneShading& result) {
  evaluate_by<N, FastPower>(s, batch, lookups, with_alpha, result);
}
SELVEDGE_THREE_BODIES(evaluate_exact,
                      (const SharedInputs& s, const LaneBatch& batch, const AllLookups& lookups,
                       bool with_alpha, LaneShading& result),
                      (s, batch, lookups, with_alpha, result))
SELVEDGE_THREE_BODIES(evaluate_fast,
                      (const SharedInputs& s, const LaneBatch& batch, const AllLookups& lookups,
                       bool with_alpha, LaneShading& result),
                      (s, batch, lookups, with_alpha, result))

}  // namespace

void evaluate_lanes(const PackedFabric& fabric, std::span<const LaneTexels> texels,
                    const LaneDirections& view, std::span<const LaneLight> lights, LaneScratch& scratch,
                    LaneShading& sum, PowerKind power) {
  if (texels.empty()) return;
  static const auto fill = fill_all_for_this_processor();
  static const std::array by_power{evaluate_exact_for_this_processor(), evaluate_fast_for_this_processor()};
  const auto evaluate = by_power[static_cast<std::size_t>(power)];
  const std::size_t at_once = std::min(lights.size(), lights_at_once);
  scratch.view_functions.resize(fabric.view_functions * lane_count);
  scratch.light_functions.resize(at_once * fabric.light_functions * 3 * lane_count);
  AllLookups lookups;
  std::size_t first = 0;
  do {
    const std::size_t count = std::min(lights.size() - first, lights_at_once);
    const SharedInputs surroundings{fabric, view, lights.subspan(first, count), scratch.view_functions.data(),
                                    scratch.light_functions.data()};
    fill(surroundings, lookups);
    for (const LaneTexels& list : texels) {
      for_each_batch(fabric, list, [&](const LaneBatch& batch) {
        evaluate(surroundings, batch, lookups, first == 0, sum);
      });
    }
    first += count;
  } while (first < lights.size());
}

}  // namespace selvedge
