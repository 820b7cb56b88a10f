// Small scenes and fabrics for the viewer's tests.
#pragma once

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/base/random.h"
#include "format/fabric/fabric.h"
#include "format/scene/scene.h"
#include "tests/format/fabrics.h"

namespace selvedge::test {

/// A random direction of the whole sphere, some of them straight along an axis.
inline V3f any_direction(Random& random) {
  const double kind = random.uniform();
  if (kind < 0.05) return {0, 0, 1};
  if (kind < 0.08) return {0, 0, -1};
  if (kind < 0.1) return {1, 0, 0};
  const double z = 1.25 * random.uniform() - 0.25;
  const double phi = 2 * std::numbers::pi * random.uniform();
  const double planar = std::sqrt(std::max(0.0, 1 - z * z));
  return V3f(V3d(planar * std::cos(phi), planar * std::sin(phi), z));
}

/// Random lobes, frames, view table and opacity in every texel of every level: no two texels alike.
inline Fabric random_fabric(int width, int height, std::uint64_t seed) {
  Fabric fabric;
  fabric.views = {4, 4};
  const auto views = static_cast<std::size_t>(fabric.views.count());
  for (int k = 0; k < level_count(width, height); ++k) {
    FabricLevel level;
    level.width = level_size(width, k);
    level.height = level_size(height, k);
    const auto texels = static_cast<std::size_t>(level.texels());
    Random random(seed, static_cast<std::uint64_t>(k));
    const auto number = [&](double low, double high) {
      return static_cast<float>(low + random.uniform() * (high - low));
    };
    Layer lobes{27, {}};
    for (std::size_t i = 0; i < texels * 3; ++i) {
      lobes.values.push_back(number(0.05, 0.3));
      for (int j = 0; j < 2; ++j)
        lobes.values.insert(lobes.values.end(),
                            {number(-1, 0.2), number(-1, 0.2), number(0.4, 1), number(1, 8)});
    }
    level.set_layer(LayerKind::lobes, std::move(lobes));
    level.add_layer(LayerKind::frame, 6);
    level.add_layer(LayerKind::table, 3 * fabric.views.count());
    level.add_layer(LayerKind::opacity, fabric.views.count());
    for (std::size_t i = 0; i < texels; ++i) {
      const V3f normal = V3f(number(-0.3, 0.3), number(-0.3, 0.3), 1).normalized();
      level.frame()[i] = {normal, tangent_of(normal)};
      for (std::size_t v = 0; v < views; ++v) {
        level.view_table()[i * views + v] = V3f(number(0.6, 1.4), number(0.6, 1.4), number(0.6, 1.4));
        level.opacity()[i * views + v] = number(0.2, 1);
      }
    }
    fabric.levels.push_back(level);
  }
  return fabric;
}

/// Lambertian: f = albedo / pi * cosine, opacity the same everywhere.
inline Fabric lambert_fabric(int size, const V3f& albedo, float opacity = 1) {
  Fabric fabric = lambert_fabric(size, size, albedo);
  for (FabricLevel& level : fabric.levels) level.add_layer(LayerKind::opacity, 1, opacity);
  return fabric;
}

/// A scene with one material per primitive; `fabric` as FabricReference::fabric, or none if negative.
inline SceneMaterial material(int fabric, const V4f& base_color = V4f(1, 1, 1, 1)) {
  SceneMaterial m;
  m.base_color = base_color;
  m.double_sided = true;
  if (fabric >= 0) {
    m.fabric = FabricReference{};
    m.alpha_mode = AlphaMode::mask;
    m.fabric->fabric = fabric;
  }
  return m;
}

inline void add(Scene& scene, ScenePrimitive primitive, const SceneMaterial& material,
                const M44d& world = M44d()) {
  primitive.material = static_cast<int>(scene.materials.size());
  scene.materials.push_back(material);
  SceneInstance instance;
  instance.primitive = static_cast<int>(scene.primitives.size());
  instance.world = world;
  scene.primitives.push_back(std::move(primitive));
  scene.instances.push_back(instance);
}

/// The square [-1, 1]^2 at height z, facing +z, u = 0 ... repeats along x, v = 0 ... repeats along -y.
inline ScenePrimitive square(double repeats, float z = 0) {
  ScenePrimitive p;
  p.name = "square/0";
  for (const V2f& c : {V2f(-1, 1), V2f(-1, -1), V2f(1, -1), V2f(1, 1)}) {
    p.positions.emplace_back(c.x, c.y, z);
    p.normals.emplace_back(0.0F, 0.0F, 1.0F);
    p.tex_coords[0].emplace_back((c.x + 1) / 2 * repeats, (1 - c.y) / 2 * repeats);
  }
  p.indices = {0, 1, 2, 0, 2, 3};
  return p;
}

/// The unit sphere, u around the y axis, v from the north pole down.
inline ScenePrimitive sphere(int columns, int rows, const V2d& repeats) {
  ScenePrimitive p;
  p.name = "sphere/0";
  for (int j = 0; j <= rows; ++j) {
    for (int i = 0; i <= columns; ++i) {
      const double phi = 2 * std::numbers::pi * i / columns;
      const double theta = std::numbers::pi * j / rows;
      const V3d n(std::sin(theta) * std::sin(phi), std::cos(theta), std::sin(theta) * std::cos(phi));
      p.positions.emplace_back(n);
      p.normals.emplace_back(n);
      p.tex_coords[0].emplace_back(repeats.x * i / columns, repeats.y * j / rows);
    }
  }
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (columns + 1) + i); };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      if (j > 0) p.indices.insert(p.indices.end(), {at(i, j), at(i, j + 1), at(i + 1, j)});
      if (j + 1 < rows) p.indices.insert(p.indices.end(), {at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)});
    }
  }
  return p;
}

}  // namespace selvedge::test
