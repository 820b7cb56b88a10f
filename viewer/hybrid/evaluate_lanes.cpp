#include "viewer/hybrid/evaluate_lanes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include "format/fabric/lafortune.h"
#include "format/simd/fetch.h"
#include "viewer/hybrid/wide_directions.h"

namespace selvedge {
namespace {

constexpr std::size_t max_lobes = 16;

// Lookups of directions in a fabric's tables, which all texels of sixteen pixels share.

/// Number of lights whose lookups are computed together.
constexpr std::size_t lights_at_once = 8;

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

// Levels of products alone. Their F is linear in the coefficients, so the coefficients of all texels under a
// pixel are averaged first and F is evaluated once; negative F counts as 0 only then.

template <std::size_t N>
SELVEDGE_INLINE void sum_texels(const PackedFabric& fabric, const LaneTexels& texels, std::uint32_t lanes,
                                const AllLookups& lookups, const MeanProducts& mean, LaneFloats& alpha) {
  using Wide = WideFloat<N>;
  const PackedLayout& layout = *mean.layout;
  const std::size_t stride = std::size_t{4} * layout.coefficient_groups();
  const std::size_t views = fabric.fabric->views.count();
  for (std::uint32_t left = lanes; left != 0; left &= left - 1) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(left));
    const PackedLevel& level = fabric.levels[texels.level[lane]];
    const std::size_t texel = texels.texel[lane];
    float share = texels.weight[lane];
    if (layout.has_views) {
      const auto& taps = reinterpret_cast<const Lookups<N>*>(lookups.bytes.data())[lane / N].view;
      const float* opacity = level.opacity.data() + texel * views;
      float sum = 0;
      for (std::size_t tap = 0; tap < 4; ++tap)
        sum += opacity[taps.cell[tap][lane % N]] * taps.weight[tap].v[lane % N];
      share *= std::min(sum, 1.0F);
    }
    if (!(share > 0)) continue;
    alpha[lane] += share;
    const float* from = level.coefficients.data()->data() + texel * stride;
    float* to = mean.sums + lane * stride;
    for (std::size_t k = 0; k < stride; k += N)
      (Wide::load(to + k) + Wide::load(from + k) * Wide(share)).store(to + k);
  }
}
SELVEDGE_THREE_BODIES(sum_texels,
                      (const PackedFabric& fabric, const LaneTexels& texels, std::uint32_t lanes,
                       const AllLookups& lookups, const MeanProducts& mean, LaneFloats& alpha),
                      (fabric, texels, lanes, lookups, mean, alpha))

/// f = l_z sum over b of psi_b(l) (sum over a of c_ab phi_a(v)): the inner sums are the same for all lights.
template <std::size_t N>
SELVEDGE_INLINE void add_light(const SharedInputs& s, const MeanProducts& mean, const LaneSmoothLight* around,
                               std::size_t first, float* of_lights, LaneShading& result) {
  using Wide = WideFloat<N>;
  const PackedLayout& layout = *mean.layout;
  const std::size_t functions = s.fabric.light_functions;
  const std::size_t groups = layout.coefficient_groups();
  const Wide zero(0);
  const Group* lanes[N];  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t lane = 0; lane < N; ++lane)
    lanes[lane] = reinterpret_cast<const Group*>(mean.sums) + (first + lane) * groups;
  for (std::size_t b = 0; b < functions; ++b) zero.store(of_lights + b * lane_count);
  Wide group[4];  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t m = 0; m < layout.pairs.size(); ++m) {
    if (m % 4 == 0) fetch<N>(lanes, m / 4, group);
    const V2i& pair = layout.pairs[m];
    Wide factor = group[m % 4];
    if (pair.x > 0) factor *= Wide::load(s.view_functions + (pair.x - 1) * lane_count + first);
    float* sum = of_lights + pair.y * lane_count;
    (Wide::load(sum) + factor).store(sum);
  }
  const Wide view_z = Wide::load(&s.view.z[first]);
  const Wide scale(s.fabric.fabric->radiance_scale);
  Wide sum[3] = {zero, zero, zero};  // NOLINT(modernize-avoid-c-arrays)
  for (std::size_t i = 0; i < s.lights.size(); ++i) {
    const LaneLight& light = s.lights[i];
    const Wide cosine = Wide::load(&light.direction.z[first]);
    const Wide above = min(cosine, view_z);
    if (!any_greater(above, zero)) continue;
    const Wide irradiance = if_greater(above, zero, Wide::load(&light.share[first]), zero);
    Wide factor[3] = {zero, zero, zero};  // NOLINT(modernize-avoid-c-arrays)
    for (std::size_t b = 0; b < functions; ++b) {
      const Wide of_b = Wide::load(of_lights + b * lane_count);
      const float* psi = s.light_functions + (i * functions + b) * 4 * lane_count + first;
      for (std::size_t c = 0; c < 3; ++c) factor[c] += of_b * Wide::load(psi + c * lane_count);
    }
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += clamp_to_finite(scale * clamp_to_finite(max(factor[c], zero) * cosine)) *
                (irradiance * Wide(light.irradiance[static_cast<int>(c)]));
  }
  if (around != nullptr) {
    Wide factor[3] = {zero, zero, zero};  // NOLINT(modernize-avoid-c-arrays)
    const float* of_sky = s.fabric.around_basis.data();
    for (std::size_t b = 0; b < functions; ++b) {
      const Wide of_b = Wide::load(of_lights + b * lane_count);
      for (const LaneColours& light : around->factors) {
        for (std::size_t c = 0; c < 3; ++c)
          factor[c] += of_b * (Wide(*of_sky++) * Wide::load(&light[c][first]));
      }
    }
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += if_greater(view_z, zero, clamp_to_finite(scale * max(factor[c], zero)), zero);
  }
  const auto add = [&](LaneFloats & channel, const Wide& value) __attribute__((always_inline)) {
    (Wide::load(&channel[first]) + value).store(&channel[first]);
  };
  add(result.red, sum[0]);
  add(result.green, sum[1]);
  add(result.blue, sum[2]);
}

template <std::size_t N>
SELVEDGE_INLINE void shine_lanes(const SharedInputs& s, const MeanProducts& mean,
                                 const LaneSmoothLight* around, float* of_lights, LaneShading& result) {
  for (std::size_t first = 0; first < lane_count; first += N)
    add_light<N>(s, mean, around, first, of_lights, result);
}
SELVEDGE_THREE_BODIES(shine_lanes,
                      (const SharedInputs& s, const MeanProducts& mean, const LaneSmoothLight* around,
                       float* of_lights, LaneShading& result),
                      (s, mean, around, of_lights, result))

/// Adds the texels of `lanes`, whose levels have the layout, and their opacity to `alpha`.
void add_texels(const PackedFabric& fabric, const LaneTexels& texels, std::uint32_t lanes,
                const AllLookups& lookups, const MeanProducts& mean, LaneFloats& alpha) {
  static const auto sum = sum_texels_for_this_processor();
  sum(fabric, texels, lanes, lookups, mean, alpha);
}

/// Adds the light of the sums to `result`, also from all `around` if that is not null. `of_lights`: memory,
/// [b][lane].
void shine(const SharedInputs& s, const MeanProducts& mean, const LaneSmoothLight* around, float* of_lights,
           LaneShading& result) {
  static const auto shine_all = shine_lanes_for_this_processor();
  shine_all(s, mean, around, of_lights, result);
}

// All other levels: texel by texel.

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
    const float* psi = s.light_functions + (light * functions + pair.y) * 4 * lane_count + first;
    for (std::size_t c = 0; c < 3; ++c) sum[c] += factor * Wide::load(psi + c * lane_count);
  }
}

/// Evaluates the texels of one batch; `with_alpha`: adds opacity as well. `Known` is the number of lobes if
/// it is known at compile time, else 0.
template <std::size_t N, int Known>
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
      const Wide bracket = lafortune_lobes(parameters + c * per_channel, lobes, to_light, in_texel);
      factor[c] =
          clamp_to_finite(factor[c] * clamp_to_finite(if_greater(cosine, zero, bracket * cosine, zero)));
    }
    const Wide scale(s.fabric.fabric->radiance_scale);
    for (std::size_t c = 0; c < 3; ++c)
      sum[c] += clamp_to_finite(scale * factor[c]) *
                (irradiance * (light.colours != nullptr ? Wide::load(&(*light.colours)[c][first])
                                                        : Wide(light.irradiance[static_cast<int>(c)])));
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

/// Calls body(layout, lanes, the first of them) for groups of lanes whose levels have one layout.
template <class Body>
void for_each_layout(const PackedFabric& fabric, const LaneTexels& texels, const Body& body) {
  const auto layout_of = [&](std::size_t lane) { return fabric.levels[texels.level[lane]].layout; };
  std::uint32_t remaining = 0;
  for (std::size_t lane = 0; lane < lane_count; ++lane)
    remaining |= (texels.weight[lane] > 0 ? 1U : 0U) << lane;
  if (remaining == 0) return;
  // Most lists have texels of one level.
  std::int32_t other_level = 0;
  for (std::size_t lane = 0; lane < lane_count; ++lane)
    other_level |=
        texels.weight[lane] > 0 ? texels.level[lane] ^ texels.level[std::countr_zero(remaining)] : 0;
  while (remaining != 0) {
    const int leader = std::countr_zero(remaining);
    const int layout = layout_of(leader);
    std::uint32_t group = remaining;
    if (other_level != 0 && fabric.layouts.size() > 1) {
      for (std::size_t lane = 0; lane < lane_count; ++lane) {
        const bool other = (remaining >> lane & 1U) != 0 && layout_of(lane) != layout;
        group &= ~((other ? 1U : 0U) << lane);
      }
    }
    remaining &= ~group;
    body(static_cast<std::size_t>(layout), group, static_cast<std::size_t>(leader));
  }
}

template <std::size_t N>
SELVEDGE_INLINE void fill_all(const SharedInputs& s, AllLookups& lookups) {
  for (std::size_t i = 0; i < lane_count / N; ++i)
    fill<N>(s, i * N, reinterpret_cast<Lookups<N>*>(lookups.bytes.data())[i]);
}
SELVEDGE_THREE_BODIES(fill_all, (const SharedInputs& s, AllLookups& lookups), (s, lookups))

template <std::size_t N>
SELVEDGE_INLINE void evaluate_all(const SharedInputs& s, const LaneBatch& batch, const AllLookups& lookups,
                                  bool with_alpha, LaneShading& result) {
  for (std::size_t i = 0; i < lane_count / N; ++i) {
    const Lookups<N>& lane_lookups = reinterpret_cast<const Lookups<N>*>(lookups.bytes.data())[i];
    // The most frequent number of lobes.
    if (batch.layout.lobes == 2)
      evaluate<N, 2>(s, batch, lane_lookups, i * N, with_alpha, result);
    else
      evaluate<N, 0>(s, batch, lane_lookups, i * N, with_alpha, result);
  }
}
SELVEDGE_THREE_BODIES(evaluate_all,
                      (const SharedInputs& s, const LaneBatch& batch, const AllLookups& lookups,
                       bool with_alpha, LaneShading& result),
                      (s, batch, lookups, with_alpha, result))

/// The sums of a layout's texels, among those begun before or new.
const MeanProducts& mean_of(const PackedLayout& layout, LaneScratch& scratch) {
  for (const MeanProducts& mean : scratch.means) {
    if (mean.layout == &layout) return mean;
  }
  const std::size_t number = scratch.means.size();
  if (scratch.sums.size() <= number) scratch.sums.emplace_back();
  scratch.sums[number].assign(std::size_t{4} * layout.coefficient_groups() * lane_count, 0.0F);
  return scratch.means.emplace_back(MeanProducts{&layout, scratch.sums[number].data()});
}

/// A ring of directions of one height, and the solid angle of each.
struct Ring {
  float z;
  std::size_t count;
  float solid_angle;
};
/// Gauss-Legendre over the height: polynomials of z up to degree 5 have their integrals over the hemisphere.
constexpr float two_pi = 2 * std::numbers::pi_v<float>;
constexpr std::array rings{Ring{0.112701665F, 4, two_pi * 5 / 18 / 4}, Ring{0.5F, 5, two_pi * 8 / 18 / 5},
                           Ring{0.887298335F, 3, two_pi * 5 / 18 / 3}};

/// Light from all around as lamps in the axes of the fabric, none below `least`.
void place_lamps(const LaneSmoothLight& around, float least, LaneScratch& scratch) {
  std::vector<std::pair<V3f, float>> places;
  for (const Ring& ring : rings) {
    const float planar = std::sqrt(1 - ring.z * ring.z);
    for (std::size_t i = 0; i < ring.count; ++i) {
      const float angle = two_pi * (static_cast<float>(i) + ring.z) / static_cast<float>(ring.count);
      places.emplace_back(V3f(planar * std::cos(angle), planar * std::sin(angle), ring.z), ring.solid_angle);
    }
  }
  scratch.lamps.resize(places.size());
  scratch.colours.resize(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const V3f& d = places[i].first;
    const auto basis = smooth_basis(d.x, d.y, d.z);
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t lane = 0; lane < lane_count; ++lane) {
        float sum = 0;
        for (std::size_t k = 0; k < smooth_functions; ++k) sum += basis[k] * around.factors[k][c][lane];
        scratch.colours[i][c][lane] = std::max(sum, least);
      }
    }
    LaneLight& lamp = scratch.lamps[i];
    lamp.direction.x.fill(d.x);
    lamp.direction.y.fill(d.y);
    lamp.direction.z.fill(d.z);
    lamp.share.fill(places[i].second);
    lamp.colours = &scratch.colours[i];
  }
}

/// The addend of the result.
struct Parts {
  bool opacity = true;
  bool linear = true;  ///< levels of products alone, and `around`
  const LaneSmoothLight* around = nullptr;
};

void evaluate_lists(const PackedFabric& fabric, std::span<const LaneTexels> texels,
                    const LaneDirections& view, std::span<const LaneLight> lights, const Parts& parts,
                    LaneScratch& scratch, LaneShading& sum) {
  static const auto fill = fill_all_for_this_processor();
  static const auto evaluate = evaluate_all_for_this_processor();
  const std::size_t at_once = std::min(lights.size(), lights_at_once);
  scratch.view_functions.resize(fabric.view_stride * lane_count);
  scratch.light_functions.resize(at_once * fabric.light_functions * 4 * lane_count);
  scratch.rows.resize(std::max(fabric.view_stride, 4 * fabric.light_stride) * lane_count);
  scratch.of_lights.resize(fabric.light_functions * lane_count);
  std::vector<MeanProducts>& means = scratch.means;
  means.clear();
  AllLookups lookups;
  std::size_t first = 0;
  do {
    const std::size_t count = std::min(lights.size() - first, lights_at_once);
    const SharedInputs surroundings{fabric,
                                    view,
                                    lights.subspan(first, count),
                                    scratch.view_functions.data(),
                                    scratch.light_functions.data(),
                                    scratch.rows.data()};
    fill(surroundings, lookups);
    for (const LaneTexels& list : texels) {
      for_each_layout(fabric, list, [&](std::size_t number, std::uint32_t lanes, std::size_t leader) {
        const PackedLayout& layout = fabric.layouts[number];
        if (!layout.is_linear()) {
          evaluate(surroundings, batch_of(fabric, list, layout, lanes, leader), lookups,
                   parts.opacity && first == 0, sum);
        } else if (parts.linear && first == 0) {
          add_texels(fabric, list, lanes, lookups, mean_of(layout, scratch), sum.alpha);
        }
      });
    }
    for (const MeanProducts& mean : means)
      shine(surroundings, mean, first == 0 ? parts.around : nullptr, scratch.of_lights.data(), sum);
    first += count;
  } while (first < lights.size());
}

/// evaluate_lanes() without light from behind.
void evaluate_side(const PackedFabric& fabric, std::span<const LaneTexels> texels, const LaneDirections& view,
                   std::span<const LaneLight> lights, const LaneSmoothLight* around, LaneScratch& scratch,
                   LaneShading& sum) {
  evaluate_lists(fabric, texels, view, lights, {true, true, around}, scratch, sum);
  if (around == nullptr || std::all_of(fabric.layouts.begin(), fabric.layouts.end(),
                                       [](const PackedLayout& layout) { return layout.is_linear(); }))
    return;
  // The dark side of what a scene hides from itself is below 0 here and there.
  place_lamps(*around, lets_through(fabric.fabric->side) ? 0 : std::numeric_limits<float>::lowest(), scratch);
  evaluate_lists(fabric, texels, view, scratch.lamps, {false, false, nullptr}, scratch, sum);
}

/// Adds light that comes through; the opacity is known.
void shine_through(const PackedFabric& through, std::span<const LaneTexels> texels,
                   const LaneDirections& view, std::span<const LaneLight> lights,
                   const LaneSmoothLight* around, LaneScratch& scratch, LaneShading& sum) {
  scratch.behind.clear();
  for (const LaneLight& light : lights) {
    if (std::ranges::none_of(light.direction.z, [](float z) { return z < 0; })) continue;
    for (float& z : scratch.behind.emplace_back(light).direction.z) z = -z;
  }
  if (scratch.behind.empty() && around == nullptr) return;
  LaneSmoothLight mirrored;
  for (std::size_t k = 0; around != nullptr && k < smooth_functions; ++k) {
    mirrored.factors[k] = around->factors[k];
    if (!is_odd_in_z(k)) continue;
    for (LaneFloats& colour : mirrored.factors[k]) {
      for (float& factor : colour) factor = -factor;
    }
  }
  LaneShading added;
  evaluate_side(through, texels, view, scratch.behind, around != nullptr ? &mirrored : nullptr, scratch,
                added);
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    sum.red[lane] += added.red[lane];
    sum.green[lane] += added.green[lane];
    sum.blue[lane] += added.blue[lane];
  }
}

}  // namespace

void evaluate_lanes(const PackedFabric& fabric, std::span<const LaneTexels> texels,
                    const LaneDirections& view, std::span<const LaneLight> lights, LaneScratch& scratch,
                    LaneShading& sum, const LaneSmoothLight* around) {
  if (texels.empty()) return;
  evaluate_side(fabric, texels, view, lights, around, scratch, sum);
  if (fabric.through) shine_through(*fabric.through, texels, view, lights, around, scratch, sum);
}

}  // namespace selvedge
