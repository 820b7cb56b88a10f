#include "format/evaluate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "format/lafortune.h"

namespace selvedge {
namespace {

std::size_t index_of(int a, int b, int size_of_b) {
  return static_cast<std::size_t>(a) * static_cast<std::size_t>(size_of_b) + static_cast<std::size_t>(b);
}

/// Values that overflow are held at the largest number: no infinity spreads.
V3f held(V3f radiance) {
  for (int c = 0; c < 3; ++c) radiance[c] = std::min(radiance[c], std::numeric_limits<float>::max());
  return radiance;
}

/// T(v) and alpha(v) of one texel: two layers, one interpolation.
struct ViewFactors {
  V3f colour{1, 1, 1};
  float alpha = 1;
};

ViewFactors view_factors(const FabricLevel& level, const DirectionGrid& grid, int texel, const V3f& view) {
  ViewFactors result;
  if (!level.view_table && !level.opacity) return result;
  const DirectionTaps taps = interpolate(grid, view);
  V3f colour(0, 0, 0);
  float alpha = 0;
  for (std::size_t tap = 0; tap < 4; ++tap) {
    const std::size_t entry = index_of(texel, taps.cell[tap], grid.count());
    const float weight = taps.weight[tap] * (level.opacity ? level.opacity->opacity[entry] : 1.0F);
    alpha += weight;
    if (level.view_table) colour += weight * level.view_table->colour[entry];
  }
  if (level.opacity) result.alpha = std::min(alpha, 1.0F);
  if (level.view_table) result.colour = alpha > 0 ? held(colour / alpha) : V3f(0, 0, 0);
  return result;
}

V3f lobe_radiance(const FabricLevel& level, int texel, const V3f& light, const V3f& view) {
  if (!level.lobes) return {1, 1, 1};
  V3f l = light;
  V3f v = view;
  if (level.frame) {
    const V3f& n = level.frame->normal[static_cast<std::size_t>(texel)];
    const V3f& t = level.frame->tangent[static_cast<std::size_t>(texel)];
    const V3f b = n.cross(t);
    l = {light.dot(t), light.dot(b), light.dot(n)};
    v = {view.dot(t), view.dot(b), view.dot(n)};
  }
  const int lobes = level.lobes->lobes;
  V3f radiance;
  for (int channel = 0; channel < 3; ++channel) {
    const float* parameters =
        level.lobes->parameters.data() + index_of(texel * 3 + channel, 0, parameter_count(lobes));
    // A lobe may overflow; held at the largest number it stays 0 where T or opacity are 0.
    radiance[channel] = lafortune(parameters, lobes, &l.x, &v.x);
  }
  return held(radiance);
}

}  // namespace

Shading evaluate(const FabricLevel& level, const DirectionGrid& views, int x, int y, const V3f& light,
                 const V3f& view) {
  const int texel = y * level.width + x;
  const ViewFactors factors = view_factors(level, views, texel, view);
  Shading shading;
  shading.alpha = factors.alpha;
  if (light.z > 0 && view.z > 0) {
    shading.radiance = held(factors.colour * lobe_radiance(level, texel, light, view));
  }
  return shading;
}

Shading evaluate(const Fabric& fabric, int level, int x, int y, const V3f& light, const V3f& view) {
  return evaluate(fabric.levels[static_cast<std::size_t>(level)], fabric.views, x, y, light, view);
}

LevelBlend level_blend(double level, int count) {
  const double clamped = level > 0 ? std::min(level, static_cast<double>(count - 1)) : 0;
  const int lower = static_cast<int>(clamped);
  return {lower, static_cast<float>(clamped - lower)};
}

int wrap_texel(double c, int size) {
  const double fraction = c - std::floor(c);
  return std::min(static_cast<int>(fraction * size), size - 1);
}

Shading blend(const Shading& a, const Shading& b, float weight_of_b) {
  const float of_a = (1 - weight_of_b) * a.alpha;
  const float of_b = weight_of_b * b.alpha;
  Shading result;
  result.alpha = of_a + of_b;
  if (result.alpha > 0) result.radiance = held((of_a * a.radiance + of_b * b.radiance) / result.alpha);
  return result;
}

Shading evaluate(const Fabric& fabric, double level, const V2d& uv, const V3f& light, const V3f& view) {
  const LevelBlend levels = level_blend(level, static_cast<int>(fabric.levels.size()));
  const auto at = [&](int k) {
    const FabricLevel& of = fabric.levels[static_cast<std::size_t>(k)];
    return evaluate(of, fabric.views, wrap_texel(uv.x, of.width), wrap_texel(uv.y, of.height), light, view);
  };
  const Shading near = at(levels.lower);
  return levels.weight > 0 ? blend(near, at(levels.lower + 1), levels.weight) : near;
}

}  // namespace selvedge
