#include "format/fabric/evaluate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "format/fabric/lafortune.h"

namespace selvedge {
namespace {

std::size_t index_of(int a, int b, int size_of_b) { return std::size_t{1} * a * size_of_b + b; }

/// Clamps values that overflow to the largest number, so that no infinity spreads.
V3f clamp_to_finite(V3f radiance) {
  for (int c = 0; c < 3; ++c) radiance[c] = std::min(radiance[c], std::numeric_limits<float>::max());
  return radiance;
}

V3f lobe_radiance(const FabricLevel& level, int texel, const V3f& light, const V3f& view) {
  V3f l = light;
  V3f v = view;
  if (level.has(LayerKind::frame)) {
    const auto& [n, t] = level.frame()[texel];
    const V3f b = n.cross(t);
    l = {light.dot(t), light.dot(b), light.dot(n)};
    v = {view.dot(t), view.dot(b), view.dot(n)};
  }
  if (!level.has(LayerKind::lobes)) return V3f(std::max(l.z, 0.0F));  // rho is 1, and there is no lobe
  const int lobes = level.lobe_count();
  V3f radiance;
  for (int channel = 0; channel < 3; ++channel) {
    const float* parameters = level.lobes().data() + index_of(texel * 3 + channel, 0, parameter_count(lobes));
    // A lobe may overflow; it is clamped below, so that its product with a T or opacity of 0 is 0.
    radiance[channel] = lafortune(parameters, lobes, &l.x, &v.x);
  }
  return clamp_to_finite(radiance);
}

/// The view's part of product m: its coefficient times phi_a.
float view_factor(const FabricLevel& level, const FabricInfo& info, std::size_t texel,
                  const DirectionTaps& views, std::size_t m) {
  return level.coefficients()[texel * level.pairs.size() + m] *
         phi(*level.bases, info, level.pairs[m].x, views);
}

/// The sum of the products; may be negative.
V3f product_sum(const FabricLevel& level, const FabricInfo& info, std::size_t texel,
                const DirectionTaps& views, const DirectionTaps& lights) {
  V3f sum(0, 0, 0);
  for (std::size_t m = 0; m < level.pairs.size(); ++m)
    sum += view_factor(level, info, texel, views, m) * psi(*level.bases, info, level.pairs[m].y, lights);
  return sum;
}

/// Clamps F: never negative, 0 for NaN as well.
V3f bracket(V3f sum) {
  for (int c = 0; c < 3; ++c) sum[c] = sum[c] > 0 ? sum[c] : 0;
  return clamp_to_finite(sum);
}

/// The bracket of the formula, by which g is multiplied.
V3f table_radiance(const FabricLevel& level, const FabricInfo& info, std::size_t texel, const V3f& view_table,
                   const DirectionTaps& lights, const DirectionTaps& views) {
  const std::span<const V3f> light_table = level.light_table();
  const bool products = level.has(LayerKind::products);
  if (light_table.empty() && !products) return view_table;
  V3f sum = level.has(LayerKind::table) || !light_table.empty() ? view_table : V3f(0, 0, 0);
  if (!light_table.empty())
    sum *= lights.interpolated(&light_table[index_of(static_cast<int>(texel), 0, info.lights.count())]);
  if (products) sum += product_sum(level, info, texel, views, lights);
  return bracket(sum);
}

}  // namespace

float phi(const ProductBases& bases, const FabricInfo& info, int a, const DirectionTaps& views) {
  return a == 0 ? 1 : views.interpolated(&bases.view[index_of(a - 1, 0, info.views.count())]);
}

V3f psi(const ProductBases& bases, const FabricInfo& info, int b, const DirectionTaps& lights) {
  return lights.interpolated(&bases.light[index_of(b, 0, info.lights.count())]);
}

ViewFactors view_factors(const FabricLevel& level, const DirectionTaps& views, int texel) {
  ViewFactors result;
  const std::span<const V3f> table = level.view_table();
  const std::span<const float> opacity = level.opacity();
  if (table.empty() && opacity.empty()) return result;
  const auto count = static_cast<int>((table.empty() ? opacity.size() : table.size()) / level.texels());
  V3f colour(0, 0, 0);
  float alpha = 0;
  for (std::size_t tap = 0; tap < 4; ++tap) {
    const std::size_t entry = index_of(texel, views.cell[tap], count);
    const float weight = views.weight[tap] * (opacity.empty() ? 1.0F : opacity[entry]);
    alpha += weight;
    if (!table.empty()) colour += weight * table[entry];
  }
  if (!opacity.empty()) result.alpha = std::min(alpha, 1.0F);
  if (!table.empty()) result.colour = alpha > 0 ? clamp_to_finite(colour / alpha) : V3f(0, 0, 0);
  return result;
}

std::vector<V3f> light_factors(const FabricLevel& level, const FabricInfo& info, int texel, const V3f& view) {
  const DirectionTaps views = interpolate(info.views, view);
  const V3f view_table = view_factors(level, views, texel).colour;
  const std::span<const V3f> light_table = level.light_table();
  const bool products = level.has(LayerKind::products);
  if (light_table.empty() && !products) return {view_table};
  const int lights = info.lights.count();
  const bool has_tables = level.has(LayerKind::table) || !light_table.empty();
  std::vector<V3f> sums(lights, has_tables ? view_table : V3f(0, 0, 0));
  for (int k = 0; k < lights && !light_table.empty(); ++k) sums[k] *= light_table[index_of(texel, k, lights)];
  for (std::size_t m = 0; products && m < level.pairs.size(); ++m) {
    const float factor = view_factor(level, info, texel, views, m);
    const V3f* psi = &level.bases->light[index_of(level.pairs[m].y, 0, lights)];
    for (int k = 0; k < lights; ++k) sums[k] += factor * psi[k];
  }
  for (V3f& sum : sums) sum = bracket(sum);
  return sums;
}

V3f radiance_of(const FabricLevel& level, const FabricInfo& info, int texel, const ViewFactors& factors,
                const TappedDirection& light, const TappedDirection& view) {
  if (!(light.direction.z > 0 && view.direction.z > 0)) return V3f(0, 0, 0);
  const V3f product =
      clamp_to_finite(table_radiance(level, info, texel, factors.colour, light.taps, view.taps) *
                      lobe_radiance(level, texel, light.direction, view.direction));
  return clamp_to_finite(info.radiance_scale * product);
}

Shading evaluate(const FabricLevel& level, const FabricInfo& info, int x, int y, const V3f& light,
                 const V3f& view) {
  const int texel = y * level.width + x;
  const TappedDirection seen(info.views, view);
  const ViewFactors factors = view_factors(level, seen.taps, texel);
  return {radiance_of(level, info, texel, factors, TappedDirection(info.lights, light), seen), factors.alpha};
}

Shading evaluate(const Fabric& fabric, int level, int x, int y, const V3f& light, const V3f& view) {
  const Fabric* const through = light.z < 0 ? fabric.find_side(Side::through) : nullptr;
  if (through == nullptr) return evaluate(fabric.levels[level], fabric, x, y, light, view);
  return evaluate(through->levels[level], *through, x, y, mirrored(light), view);
}

LevelBlend level_blend(double level, int count, int first) {
  const double clamped = level > first ? std::min(level, static_cast<double>(count - 1)) : first;
  const int lower = static_cast<int>(std::floor(clamped));
  return {lower, static_cast<float>(clamped - lower)};
}

int wrap_texel(double c, int size) {
  const double fraction = c - std::floor(c);
  return std::min(static_cast<int>(fraction * size), size - 1);
}

Shading blend(const Shading& a, const Shading& b, float weight_of_b) {
  const float alpha_a = (1 - weight_of_b) * a.alpha;
  const float alpha_b = weight_of_b * b.alpha;
  Shading result{.alpha = alpha_a + alpha_b};
  if (result.alpha > 0)
    result.radiance = clamp_to_finite((alpha_a * a.radiance + alpha_b * b.radiance) / result.alpha);
  return result;
}

Shading evaluate(const Fabric& fabric, double level, const V2d& coordinates, const V3f& light,
                 const V3f& view) {
  const auto& yarns = fabric.levels.front().yarns();
  const LevelBlend levels = level_blend(level, static_cast<int>(fabric.levels.size()), yarns ? -1 : 0);
  const V2d uv = yarns ? yarns->displaced_place(coordinates) : coordinates;
  const auto at = [&](int k) {
    if (k < 0) return yarns->shade(uv, fabric.reference_height, light, view, true);
    const FabricLevel& texels = fabric.levels[k];
    Shading shading =
        evaluate(fabric, k, wrap_texel(uv.x, texels.width), wrap_texel(uv.y, texels.height), light, view);
    if (yarns) shading.radiance *= yarns->variation_factor(uv, -1);
    return shading;
  };
  const Shading near = at(levels.finer_level);
  return levels.weight > 0 ? blend(near, at(levels.finer_level + 1), levels.weight) : near;
}

bool has_holes(const Fabric& fabric, int level) {
  const FabricLevel& texels = fabric.levels[level];
  const V3f up(0, 0, 1);
  double openness = 0;
  for (int y = 0; y < texels.height; ++y)
    for (int x = 0; x < texels.width; ++x)
      openness += 1 - static_cast<double>(evaluate(fabric, level, x, y, up, up).alpha);
  return openness > 0.0005 * texels.texels();
}

}  // namespace selvedge
