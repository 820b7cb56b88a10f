// Fabrics for tests that need no baking.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/fabric/fabric.h"
#include "tests/format/fabrics.h"

namespace selvedge::test {

/// The lower levels of a fabric whose level 0 holds everything: each texel is the mean of what it covers,
/// which a real fabric would fit. Sizes are powers of two.
inline void add_levels(Fabric& fabric) {
  while (fabric.levels.back().texels() > 1) {
    const FabricLevel& fine = fabric.levels.back();
    FabricLevel coarse;
    coarse.width = std::max(1, fine.width / 2);
    coarse.height = std::max(1, fine.height / 2);
    const std::size_t count = static_cast<std::size_t>(coarse.texels());
    const auto mean_of = [&](const Layer& layer) {
      const auto per_texel = static_cast<std::size_t>(layer.channels);
      const std::vector<float>& values = layer.values;
      std::vector<float> means;
      for (std::size_t texel = 0; texel < count; ++texel) {
        const std::size_t x = texel % static_cast<std::size_t>(coarse.width) * 2;
        const std::size_t y = texel / static_cast<std::size_t>(coarse.width) * 2;
        const auto width = static_cast<std::size_t>(fine.width);
        const std::size_t right = fine.width > 1 ? 1 : 0;
        const std::size_t below = fine.height > 1 ? width : 0;
        for (std::size_t k = 0; k < per_texel; ++k) {
          const std::size_t first = y * width + x;
          means.push_back(0.25F * (values[first * per_texel + k] + values[(first + right) * per_texel + k] +
                                   values[(first + below) * per_texel + k] +
                                   values[(first + below + right) * per_texel + k]));
        }
      }
      return Layer{layer.channels, means};
    };
    coarse.set_layer(LayerKind::lobes, mean_of(fine[LayerKind::lobes]));
    if (fine.has(LayerKind::frame)) {
      coarse.add_layer(LayerKind::frame, 6);
      for (TexelFrame& frame : coarse.frame()) frame = {V3f(0, 0, 1), V3f(1, 0, 0)};
    }
    coarse.set_layer(LayerKind::opacity, mean_of(fine[LayerKind::opacity]));
    fabric.levels.push_back(std::move(coarse));
  }
}

/// Flat, matt, of one colour.
inline Fabric lambert_fabric(const V2d& period_mm, int side, const V3f& albedo) {
  Fabric fabric = lambert_fabric(side, side, albedo);
  fabric.views = Fabric().views;
  fabric.period_mm = period_mm;
  fabric.provenance = "{}";
  return fabric;
}

/// A ribbed net: normals that lean along u, a warm and a cool half, and holes in a corner of each repeat.
inline Fabric net_fabric(const V2d& period_mm = V2d(5, 4), int side = 16) {
  Fabric fabric = lambert_fabric(period_mm, side, V3f(0.5F, 0.2F, 0.1F));
  fabric.levels.resize(1);
  FabricLevel& level = fabric.levels[0];
  const int views = fabric.views.count();
  level.add_layer(LayerKind::frame, 6);
  level.add_layer(LayerKind::opacity, views);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double phase = 2 * std::numbers::pi * (x + 0.5) / side;
      const V3f normal = V3f(V3d(-0.5 * std::cos(phase), 0, 1).normalized());
      level.frame()[y * side + x] = {normal, tangent_of(normal)};
      const bool hole = x < side / 4 && y < side / 4;
      std::fill_n(&level.opacity()[(y * side + x) * views], views, hole ? 0.0F : 1.0F);
      if (y >= side / 2) {
        const std::size_t first = static_cast<std::size_t>(y * side + x) * 3;
        std::swap(level.lobes()[first], level.lobes()[first + 2]);
      }
    }
  }
  add_levels(fabric);
  return fabric;
}

}  // namespace selvedge::test
