#include "viewer/light/sky.h"

#include <array>
#include <cmath>
#include <numbers>

#include "format/base/parallel.h"

namespace selvedge {
namespace {

/// Directions over the sphere, in pairs: one picture of the scene has the depths for a direction and for its
/// opposite.
constexpr int direction_count = 48;
constexpr int sky_size = 512;
constexpr std::size_t vertices_per_task = 1024;

/// Points of a spiral over half of the sphere, each with the same part of it.
V3f spiral_direction(int i) {
  const double z = 1 - (2 * i + 1.0) / direction_count;
  const double angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  const double planar = std::sqrt(1 - z * z);
  return V3f(V3d(planar * std::cos(angle), planar * std::sin(angle), z));
}

}  // namespace

SkyVisibility sky_visibility(const MergedSurfaces& mesh, const Occluders& occluders) {
  SkyVisibility sky;
  for (int i = 0; i < direction_count; ++i) {
    const V3f direction = spiral_direction(i / 2);
    sky.directions.push_back(i % 2 == 0 ? direction : -direction);
  }
  const std::size_t count = mesh.positions.size();
  sky.fractions.resize(count * direction_count);
  parallel_for(0, direction_count / 2, [&](int pair) {
    const std::array lamp{Light{V3d(sky.directions[2 * pair])}};
    ShadowMap back;
    const ShadowMap front =
        occluders.draw(shadow_views(lamp, mesh.positions, V3d(0, 0, 0), sky_size)[0], &back);
    for (std::size_t i = 0; i < count; ++i) {
      const Group& n = mesh.attributes[i][0];
      const V3f normal(n[0], n[1], n[2]);
      for (const int side : {0, 1}) {
        const std::size_t number = 2 * pair + side;
        const V3f& d = sky.directions[number];
        const float fraction = shadow_visibility(side == 0 ? front : back, mesh.positions[i],
                                                 normal.dot(d) > 0 ? normal : -normal, d);
        sky.fractions[i * direction_count + number] = static_cast<std::uint8_t>(std::lround(fraction * 255));
      }
    }
  });
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
    for (int k = 0; k < smooth_function_count; ++k) radiance += light.coefficients[k] * basis[k];
    const double solid_angle = 4 * std::numbers::pi / static_cast<double>(directions);
    for (int k = 0; k < smooth_function_count; ++k)
      parts[i].coefficients[k] = radiance * (basis[k] * static_cast<float>(solid_angle / smooth_norms[k]));
  }
  std::vector<SmoothLight> result(visibility.fractions.size() / directions, light);
  parallel_each(result.size(), vertices_per_task, [&](std::size_t vertex) {
    for (std::size_t i = 0; i < directions; ++i) {
      const float hidden = 1 - static_cast<float>(visibility.fractions[vertex * directions + i]) / 255;
      if (!(hidden > 0)) continue;
      for (int k = 0; k < smooth_function_count; ++k)
        result[vertex].coefficients[k] -= parts[i].coefficients[k] * hidden;
    }
  });
  return result;
}

}  // namespace selvedge
