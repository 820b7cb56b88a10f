#include "viewer/light/sky.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/base/chunks.h"

namespace selvedge {
namespace {

constexpr int direction_count = 48;
constexpr int sky_size = 512;
constexpr std::size_t vertices_per_task = 1024;

/// Points of a spiral, each with the same part of the sphere.
V3f spiral_direction(int i) {
  const double z = 1 - (2 * i + 1.0) / direction_count;
  const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  const double planar = std::sqrt(1 - z * z);
  return V3f(V3d(planar * std::cos(angle), planar * std::sin(angle), z));
}

}  // namespace

SkyVisibility sky_visibility(const GlFunctions& gl, const MergedSurfaces& mesh, const Materials& materials) {
  SkyVisibility sky;
  for (int i = 0; i < direction_count; ++i) sky.directions.push_back(spiral_direction(i));
  const std::size_t count = mesh.positions.size();
  sky.fractions.resize(count * direction_count);
  ShadowPass pass(gl, mesh, materials);
  for (std::size_t first = 0; first < direction_count; first += max_shadows) {
    std::vector<Light> lamps;
    for (std::size_t i = first; i < std::min<std::size_t>(first + max_shadows, direction_count); ++i)
      lamps.push_back({V3d(sky.directions[i])});
    pass.draw(shadow_views(lamps, mesh.positions, V3d(0, 0, 0), sky_size));
    const std::span<const ShadowMap> maps = pass.read();
    parallel_each(count, vertices_per_task, [&](std::size_t i) {
      const Group& n = mesh.attributes[i][0];
      const V3f normal(n[0], n[1], n[2]);
      for (const ShadowMap& map : maps) {
        const std::size_t number = first + map.view.light;
        const V3f& d = sky.directions[number];
        const V3f facing = normal.dot(d) > 0 ? normal : -normal;
        const float fraction = shadow_visibility(map, mesh.positions[i], facing, d);
        sky.fractions[i * direction_count + number] = static_cast<std::uint8_t>(std::lround(fraction * 255));
      }
    });
  }
  return sky;
}

std::vector<SmoothLight> light_at_vertices(const SkyVisibility& visibility, const SmoothLight& light) {
  const std::size_t directions = visibility.directions.size();
  // The contribution of each direction to the factors.
  std::vector<SmoothLight> parts(directions);
  for (std::size_t i = 0; i < directions; ++i) {
    const V3f& d = visibility.directions[i];
    const auto basis = smooth_basis(d.x, d.y, d.z);
    V3f radiance(0, 0, 0);
    for (int k = 0; k < smooth_functions; ++k) radiance += light.factors[k] * basis[k];
    const double solid_angle = 4 * std::numbers::pi / static_cast<double>(directions);
    for (int k = 0; k < smooth_functions; ++k)
      parts[i].factors[k] = radiance * (basis[k] * static_cast<float>(solid_angle / smooth_norms[k]));
  }
  std::vector<SmoothLight> result(visibility.fractions.size() / directions, light);
  parallel_each(result.size(), vertices_per_task, [&](std::size_t vertex) {
    for (std::size_t i = 0; i < directions; ++i) {
      const float hidden = 1 - static_cast<float>(visibility.fractions[vertex * directions + i]) / 255;
      if (!(hidden > 0)) continue;
      for (int k = 0; k < smooth_functions; ++k) result[vertex].factors[k] -= parts[i].factors[k] * hidden;
    }
  });
  return result;
}

}  // namespace selvedge
