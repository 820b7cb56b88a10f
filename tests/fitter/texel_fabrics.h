// Fabrics of products whose samples are known in closed form, and what a bake would have seen of them.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>

#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/samples/samples.h"

namespace selvedge::test {

/// Samples of an ideal bake of a fabric: alpha and f of every texel for the directions of the grids.
inline SampleLevel seen_of(const Fabric& fabric) {
  const FabricLevel& level = fabric.levels.front();
  SampleLevel samples{.width = level.width,
                      .height = level.height,
                      .views = fabric.views.count(),
                      .lights = fabric.lights.count()};
  samples.normal_sum.assign(level.texels(), V3f(0, 0, 1));
  for (std::size_t i = 0; i < level.frame().size(); ++i) samples.normal_sum[i] = level.frame()[i].normal;
  for (int texel = 0; texel < level.texels(); ++texel) {
    for (const V3f& view : cell_directions(fabric.views)) {
      const auto shade = [&](const V3f& light) {
        return evaluate(fabric, 0, texel % level.width, texel / level.width, light, view);
      };
      samples.alpha.push_back(shade({0, 0, 1}).alpha);
      for (const V3f& light : cell_directions(fabric.lights))
        samples.radiance.push_back(shade(light).radiance);
    }
  }
  return samples;
}

/// Texels with one product that differs from texel to texel, and a second that turns with the view; every
/// fifth is mostly hole.
inline Fabric patterned(int width, int height) {
  Fabric fabric;
  fabric.period_mm = {static_cast<float>(width), static_cast<float>(height)};
  fabric.reference_height = 1;
  fabric.thickness_mm = 1;
  fabric.views = {4, 4};
  fabric.lights = {3, 3};
  Random random(5);
  FabricLevel level;
  level.width = width;
  level.height = height;
  level.pairs = {{0, 0}, {1, 1}};
  level.add_layer(LayerKind::products, 2);
  level.add_layer(LayerKind::opacity, fabric.views.count(), 1);
  for (int i = 0; i < width * height; ++i) {
    level.coefficients()[2 * i] = 1 + static_cast<float>(random.uniform());
    level.coefficients()[2 * i + 1] = 0.5F * static_cast<float>(random.uniform());
    const auto alpha = level.opacity().subspan(std::size_t{16} * i, 16);
    if (i % 5 == 0) std::fill(alpha.begin(), alpha.end(), 0.25F);
  }
  ProductBases bases;
  for (const V3f& view : cell_directions(fabric.views)) bases.view.push_back(view.x);
  for (const V3f& light : cell_directions(fabric.lights))
    bases.light.emplace_back(light.z, light.z, light.z / 2);
  for (const V3f& light : cell_directions(fabric.lights))
    bases.light.emplace_back(V3f(0.25F + light.y * light.y));
  level.bases = std::make_shared<const ProductBases>(bases);
  fabric.levels = {level};
  return fabric;
}

/// The samples file of a fabric: its header, and pairs with the fabric itself as the truth.
inline SamplesHeader samples_header_of(const Fabric& fabric) {
  SamplesHeader header;
  header.width = fabric.levels[0].width;
  header.height = fabric.levels[0].height;
  header.period_mm = fabric.period_mm;
  header.reference_height = fabric.reference_height;
  header.thickness_mm = fabric.thickness_mm;
  header.views = fabric.views;
  header.lights = fabric.lights;
  return header;
}

inline PairSamples truth_of(const Fabric& fabric, int count) {
  PairSamples truth{.width = fabric.levels[0].width,
                    .height = fabric.levels[0].height,
                    .pairs = random_direction_pairs(count, 0.3, 3)};
  for (const DirectionPair& pair : truth.pairs) {
    for (int i = 0; i < truth.width * truth.height; ++i) {
      const Shading s = evaluate(fabric, 0, i % truth.width, i / truth.width, pair.light, pair.view);
      truth.alpha.push_back(s.alpha);
      truth.radiance.push_back(s.radiance);
    }
  }
  return truth;
}

}  // namespace selvedge::test
