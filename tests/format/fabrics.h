// Fabrics for the tests, made of seeded random numbers.
#pragma once

#include <cmath>

#include "format/base/random.h"
#include "format/fabric/fabric.h"

namespace selvedge::test {

inline float uniform(Random& random, double low, double high) {
  return static_cast<float>(low + (high - low) * random.uniform());
}

/// The paper's layers at every level, holes included; all values are exact in half precision where the file
/// holds halves.
inline Fabric random_fabric(int width, int height, DirectionGrid views, int lobes, std::uint64_t seed) {
  Fabric fabric;
  fabric.period_mm = {5, 4};
  fabric.reference_height = 2.5F;
  fabric.thickness_mm = 2.5F;
  fabric.views = views;
  fabric.provenance = R"({"test":true})";
  Random random(seed);
  const auto eighths = [&](int most) {
    return static_cast<float>(static_cast<int>(random.uniform() * (8 * most + 1))) / 8;
  };
  for (int k = 0; k < level_count(width, height); ++k) {
    FabricLevel level;
    level.width = level_size(width, k);
    level.height = level_size(height, k);
    const auto texels = static_cast<std::size_t>(level.texels());
    const std::size_t entries = texels * static_cast<std::size_t>(views.count());
    level.lobes.emplace();
    level.lobes->lobes = lobes;
    level.frame.emplace();
    level.view_table.emplace();
    level.opacity.emplace();
    for (std::size_t i = 0; i < texels; ++i) {
      for (int c = 0; c < 3; ++c) {
        level.lobes->parameters.push_back(uniform(random, 0, 0.3));
        for (int j = 0; j < lobes; ++j) {
          for (int p = 0; p < 3; ++p) level.lobes->parameters.push_back(uniform(random, -0.9, 0.9));
          level.lobes->parameters.push_back(uniform(random, 1, 20));
        }
      }
      // The 3-4-5 triangle by eighths is not unit; these frames are, to half precision.
      const bool tilted = random.uniform() < 0.5;
      level.frame->normal.push_back(tilted ? V3f(0, 0.60009765625F, 0.7998046875F) : V3f(0, 0, 1));
      level.frame->tangent.emplace_back(1.0F, 0.0F, 0.0F);
    }
    for (std::size_t i = 0; i < entries; ++i) {
      level.view_table->colour.emplace_back(eighths(2), eighths(2), eighths(2));
      level.opacity->opacity.push_back(random.uniform() < 0.2 ? 0.0F : eighths(1));
    }
    fabric.levels.push_back(std::move(level));
  }
  return fabric;
}

/// The same with all the other layers as well: light tables, two slabs, products, bases.
inline Fabric random_slab_fabric(int width, int height, DirectionGrid views, int lobes, std::uint64_t seed) {
  Fabric fabric = random_fabric(width, height, views, lobes, seed);
  Random random(seed + 1);
  const auto eighths = [&](int most) {
    return static_cast<float>(static_cast<int>(random.uniform() * (8 * most + 1))) / 8;
  };
  fabric.lights = {1, 3};
  ProductBases functions;
  for (int i = 0; i < views.count(); ++i) functions.view.push_back(eighths(2) - 1);
  for (int i = 0; i < 2 * 3; ++i) functions.light.emplace_back(eighths(1), eighths(1), eighths(2) - 1);
  const auto bases = std::make_shared<const ProductBases>(std::move(functions));
  for (FabricLevel& level : fabric.levels) {
    const auto texels = static_cast<std::size_t>(level.texels());
    level.light_table.emplace();
    for (std::size_t i = 0; i < texels * 3; ++i) {
      level.light_table->value.emplace_back(eighths(1), eighths(1), eighths(1));
    }
    // Two slabs in cells side by side, the lower one missing here and there.
    const SlabShape shape{2, 1, 2};
    std::vector<float> top;
    std::vector<float> bottom;
    for (std::size_t i = 0; i < texels * 4; ++i) {
      const bool lower = i % 4 >= 2;
      bottom.push_back(lower ? 0.0F : 1.25F);
      top.push_back(lower && random.uniform() < 0.5 ? 0.0F : bottom.back() + 0.125F + eighths(1));
    }
    level.heights.emplace(shape, std::move(top), std::move(bottom));
    level.products = ProductLayer{shape.entries(), {{0, 0}, {1, 1}}, {}};
    if (&level != &fabric.levels.front()) level.products->pairs = {{1, 0}};
    const std::size_t coefficients = texels * 4 * level.products->pairs.size();
    for (std::size_t i = 0; i < coefficients; ++i) level.products->coefficient.push_back(eighths(2) - 1);
    level.bases = bases;
  }
  return fabric;
}

/// One constant Lambert texel per level, no holes, no table.
inline Fabric lambert_fabric(int width, int height, const V3f& albedo) {
  Fabric fabric;
  fabric.views = {1, 1};
  for (int k = 0; k < level_count(width, height); ++k) {
    FabricLevel level;
    level.width = level_size(width, k);
    level.height = level_size(height, k);
    level.lobes.emplace();
    for (int i = 0; i < level.texels(); ++i) {
      for (int c = 0; c < 3; ++c) level.lobes->parameters.push_back(albedo[c] / 3.14159265358979F);
    }
    fabric.levels.push_back(std::move(level));
  }
  return fabric;
}

}  // namespace selvedge::test
