// Fabrics for the tests, made of seeded random numbers.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/base/random.h"
#include "format/fabric/fabric.h"

namespace selvedge::test {

inline float uniform(Random& random, double low, double high) {
  return static_cast<float>(low + (high - low) * random.uniform());
}

/// The unit vector at height z that is turned by an angle.
inline V3f direction_at(double z, double angle) {
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return V3f(V3d(r * std::cos(angle), r * std::sin(angle), z));
}
/// A random one between two heights.
inline V3f random_direction(Random& random, double min_z, double max_z = 1) {
  const double z = min_z + (max_z - min_z) * random.uniform();
  return direction_at(z, 2 * std::numbers::pi * random.uniform());
}

/// A random number of eighths up to `max`.
inline float eighths(Random& random, int max) {
  return static_cast<float>(static_cast<int>(random.uniform() * (8 * max + 1))) / 8;
}

/// The paper's layers at every level, holes included; values are exact in the half precision of the file.
inline Fabric random_fabric(int width, int height, DirectionGrid views, int lobes, std::uint64_t seed) {
  Fabric fabric;
  fabric.period_mm = {5, 4};
  fabric.reference_height = 2.5F;
  fabric.thickness_mm = 2.5F;
  fabric.views = views;
  fabric.provenance = R"({"test":true})";
  Random random(seed);
  for (int k = 0; k < level_count(width, height); ++k) {
    FabricLevel level;
    level.width = level_size(width, k);
    level.height = level_size(height, k);
    const auto texels = static_cast<std::size_t>(level.texels());
    const std::size_t entries = texels * static_cast<std::size_t>(views.count());
    level.add_layer(LayerKind::lobes, 3 * parameter_count(lobes));
    level.add_layer(LayerKind::frame, 6);
    level.add_layer(LayerKind::table, 3 * views.count());
    level.add_layer(LayerKind::opacity, views.count());
    float* p = level.lobes().data();
    for (std::size_t i = 0; i < texels; ++i) {
      for (int c = 0; c < 3; ++c) {
        *p++ = uniform(random, 0, 0.3);
        for (int j = 0; j < lobes; ++j) {
          for (int d = 0; d < 3; ++d) *p++ = uniform(random, -0.9, 0.9);
          *p++ = uniform(random, 1, 20);
        }
      }
      // The 3-4-5 triangle by eighths is not unit; these frames are, to half precision.
      const bool tilted = random.uniform() < 0.5;
      level.frame()[i] = {tilted ? V3f(0, 0.60009765625F, 0.7998046875F) : V3f(0, 0, 1), V3f(1, 0, 0)};
    }
    for (std::size_t i = 0; i < entries; ++i) {
      level.view_table()[i] = V3f(eighths(random, 2), eighths(random, 2), eighths(random, 2));
      level.opacity()[i] = random.uniform() < 0.2 ? 0.0F : eighths(random, 1);
    }
    fabric.levels.push_back(std::move(level));
  }
  return fabric;
}

/// The same with all the other layers as well: light tables, products, bases.
inline Fabric random_product_fabric(int width, int height, DirectionGrid views, int lobes,
                                    std::uint64_t seed) {
  Fabric fabric = random_fabric(width, height, views, lobes, seed);
  Random random(seed + 1);
  fabric.lights = {1, 3};
  ProductBases functions;
  for (int i = 0; i < views.count(); ++i) functions.view.push_back(eighths(random, 2) - 1);
  for (int i = 0; i < 2 * 3; ++i)
    functions.light.emplace_back(eighths(random, 1), eighths(random, 1), eighths(random, 2) - 1);
  const auto bases = std::make_shared<const ProductBases>(std::move(functions));
  for (FabricLevel& level : fabric.levels) {
    level.add_layer(LayerKind::light, 9);
    for (V3f& s : level.light_table()) s = V3f(eighths(random, 1), eighths(random, 1), eighths(random, 1));
    level.pairs = {{0, 0}, {1, 1}};
    if (&level != &fabric.levels.front()) level.pairs = {{1, 0}};
    level.add_layer(LayerKind::products, static_cast<int>(level.pairs.size()));
    for (float& c : level.coefficients()) c = eighths(random, 2) - 1;
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
    level.add_layer(LayerKind::lobes, 3);
    for (int i = 0; i < 3 * level.texels(); ++i) level.lobes()[i] = albedo[i % 3] / 3.14159265358979F;
    fabric.levels.push_back(std::move(level));
  }
  return fabric;
}

}  // namespace selvedge::test
