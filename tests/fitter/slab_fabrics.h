// Fabrics of slabs whose samples are known in closed form, and what a bake would have seen of them.
#pragma once

#include <doctest/doctest.h>

#include <cmath>

#include "format/base/random.h"
#include "format/fabric/evaluate.h"
#include "format/samples/samples.h"

namespace selvedge::test {

/// What a bake of a fabric would have seen: alpha and f of every texel for the directions of the grids.
inline SampleLevel seen_of(const Fabric& fabric) {
  const FabricLevel& level = fabric.levels.front();
  SampleLevel samples;
  samples.width = level.width;
  samples.height = level.height;
  samples.views = fabric.views.count();
  samples.lights = fabric.lights.count();
  samples.normal.assign(level.texels(), V3f(0, 0, 1));
  for (std::size_t i = 0; i < level.frame().size(); ++i) samples.normal[i] = level.frame()[i].normal;
  for (int texel = 0; texel < level.texels(); ++texel) {
    for (const V3f& view : directions_of(fabric.views)) {
      const auto shade = [&](const V3f& light) {
        return evaluate(fabric, 0, texel % level.width, texel / level.width, light, view);
      };
      samples.alpha.push_back(shade({0, 0, 1}).alpha);
      for (const V3f& light : directions_of(fabric.lights)) samples.radiance.push_back(shade(light).radiance);
    }
  }
  return samples;
}

/// Ribs of yarn with gaps, one product that differs from entry to entry, and a second that turns with the
/// view.
inline Fabric ribbed(int width, int height) {
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
  const SlabShape shape{2, 1, 1};
  Layer products{2 * shape.entries(), {}};
  std::vector<float> top;
  for (int i = 0; i < width * height * shape.entries(); ++i) {
    top.push_back(i % 5 == 0 ? 0 : 0.5F + 0.5F * static_cast<float>(random.uniform()));
    products.values.push_back(1 + static_cast<float>(random.uniform()));
    products.values.push_back(0.5F * static_cast<float>(random.uniform()));
  }
  level.set_heights({shape, top, std::vector<float>(top.size(), 0)});
  level.pairs = {{0, 0}, {1, 1}};
  level.set(LayerKind::products, products);
  ProductBases bases;
  for (const V3f& view : directions_of(fabric.views)) bases.view.push_back(view.x);
  for (const V3f& light : directions_of(fabric.lights))
    bases.light.emplace_back(light.z, light.z, light.z / 2);
  for (const V3f& light : directions_of(fabric.lights))
    bases.light.emplace_back(V3f(0.25F + light.y * light.y));
  level.bases = std::make_shared<const ProductBases>(bases);
  fabric.levels = {level};
  REQUIRE(validate(fabric));
  return fabric;
}

/// The same with lobes of one shape in frames of two kinds: what is seen of them is gloss along the fibres.
inline Fabric glossy(int width, int height) {
  Fabric fabric = ribbed(width, height);
  fabric.views = {6, 6};
  fabric.lights = {6, 6};
  FabricLevel& level = fabric.levels.front();
  level.pairs = {{0, 0}};
  std::vector<float> first;
  for (std::size_t i = 0; i < level.coefficients().size(); i += 2) {
    first.push_back(level.coefficients()[i]);
  }
  level.set(LayerKind::products, {level.cells.entries(), first});
  ProductBases bases;
  for (const V3f& light : directions_of(fabric.lights)) {
    bases.light.emplace_back(1 + 0.5F * light.x, 0.9F, 0.8F + 0.2F * light.y);
  }
  level.bases = std::make_shared<const ProductBases>(bases);
  Layer lobes{15, {}};
  level.add(LayerKind::frame, 6);
  for (int texel = 0; texel < level.texels(); ++texel) {
    const bool turned = texel % width < width / 2;
    level.frame()[texel] = {turned ? V3f(0, 0, 1) : V3f(0.28F, 0, 0.96F),
                            turned ? V3f(0, 1, 0) : V3f(0.96F, 0, -0.28F)};
    for (int c = 0; c < 3; ++c) {
      // 3 (0.7 x + 0.7 z - y)^6, x across the fibre.
      const float size = std::pow(3.0F, 1.0F / 6);
      lobes.values.insert(lobes.values.end(), {0.3F, -size, 0.7F * size, 0.7F * size, 6});
    }
  }
  level.set(LayerKind::lobes, lobes);
  REQUIRE(validate(fabric));
  return fabric;
}

inline HeightLayer heights_of(const Fabric& fabric) {
  HeightLayer heights{fabric.levels[0].cells, {}, {}};
  for (const auto& [top, bottom] : fabric.levels[0].heights()) {
    heights.top.push_back(top);
    heights.bottom.push_back(bottom);
  }
  return heights;
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
  header.slabs = fabric.levels[0].cells;
  return header;
}

inline PairSamples truth_of(const Fabric& fabric, int count) {
  PairSamples truth;
  truth.width = fabric.levels[0].width;
  truth.height = fabric.levels[0].height;
  truth.pairs = random_pairs(count, 0.3, 3);
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
