#include "viewer/hybrid/mean_products.h"

#include <algorithm>
#include <bit>

namespace selvedge {
namespace {

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

}  // namespace

void add_texels(const PackedFabric& fabric, const LaneTexels& texels, std::uint32_t lanes,
                const AllLookups& lookups, const MeanProducts& mean, LaneFloats& alpha) {
  static const auto sum = sum_texels_for_this_processor();
  sum(fabric, texels, lanes, lookups, mean, alpha);
}

void shine(const SharedInputs& s, const MeanProducts& mean, const LaneSmoothLight* around, float* of_lights,
           LaneShading& result) {
  static const auto shine_all = shine_lanes_for_this_processor();
  shine_all(s, mean, around, of_lights, result);
}

}  // namespace selvedge
