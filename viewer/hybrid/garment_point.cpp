#include "viewer/hybrid/garment_point.h"

#include <Imath/half.h>

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

/// Smallest cosine between view and normal after bending.
constexpr float horizon = 0.01F;

/// `v` normalised; `otherwise` if it has no direction.
V3f unit_or(const V3f& v, const V3f& otherwise) {
  const float length2 = v.dot(v);
  return length2 > 1e-36F && length2 < 1e36F ? v / std::sqrt(length2) : otherwise;
}

/// `t` perpendicular to the normal; the fixed axis where it has no direction (tangent_of()).
V3f across(const V3f& normal, const V3f& t) {
  return unit_or(t - normal * normal.dot(t), tangent_of(normal));
}

float signed_fraction(std::uint32_t bits) {
  return std::max(static_cast<float>(static_cast<std::int16_t>(bits & 0xffffU)) / 32767.0F, -1.0F);
}
float fraction(std::uint32_t bits) { return static_cast<float>(bits & 0xffffU) / 65535.0F; }
float half_number(std::uint32_t bits) {
  Imath::half number;
  number.setBits(static_cast<std::uint16_t>(bits & 0xffffU));
  return number;
}

}  // namespace

GarmentPoint garment_point(const FrameScene& scene, TriangleSide seen, int x, int y) {
  const MergedSurfaces& mesh = scene.prepared.mesh;
  const ProjectedVertices& projected = scene.projected;
  GarmentPoint point;
  point.triangle = seen / 2;
  point.is_back = seen % 2 != 0;
  const MergedTriangle& triangle = mesh.triangles[point.triangle];
  point.surface = triangle.surface;
  const V2f at(static_cast<float>(x) + 0.5F - 0.5F * static_cast<float>(projected.width),
               static_cast<float>(y) + 0.5F - 0.5F * static_cast<float>(projected.height));
  const ViewDirections rays = view_directions(scene.view.camera, projected.width, projected.height);
  point.to_viewer = (rays.centre_direction + rays.step_right * at.x + rays.step_up * at.y).normalized();
  // Corners relative to the pixel, times their w. d p / dx = (-w, 0), d p / dy = (0, -w).
  std::array<V2f, 3> p;
  std::array<float, 3> w{};
  std::array<V2f, 3> uv;
  for (std::size_t k = 0; k < 3; ++k) {
    const Group& g = projected.screen[triangle.corners[k]];
    w[k] = g[2];
    p[k] = V2f(g[0], g[1]) - at * w[k];
    uv[k] = mesh.uv(triangle.corners[k]);
  }
  std::array<float, 3> edge{}, right{}, up{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t a = (k + 1) % 3;
    const std::size_t b = (k + 2) % 3;
    edge[k] = p[a].cross(p[b]);
    right[k] = w[b] * p[a].y - w[a] * p[b].y;
    up[k] = p[b].x * w[a] - p[a].x * w[b];
  }
  const auto sum = [](const std::array<float, 3>& values) { return values[0] + values[1] + values[2]; };
  const float whole = sum(edge);
  const float scale = std::abs(whole) > 0 ? 1 / whole : 0;
  const V2f first(std::floor(uv[0].x), std::floor(uv[0].y));
  for (std::size_t k = 0; k < 3; ++k) {
    const float weight = scale > 0 || scale < 0 ? edge[k] * scale : 1.0F / 3;
    point.barycentrics[k] = weight;
    const std::uint32_t vertex = triangle.corners[k];
    point.position += mesh.positions[vertex] * weight;
    point.normal += mesh.normal(vertex) * weight;
    point.tangent += mesh.tangent(vertex) * weight;
    point.uv += (uv[k] - first) * weight;
    point.duv_dx += (uv[k] - uv[0]) * ((right[k] - weight * sum(right)) * scale);
    point.duv_dy += (uv[k] - uv[0]) * ((up[k] - weight * sum(up)) * scale);
  }
  for (int axis = 0; axis < 2; ++axis) {
    float& c = point.uv[axis];
    c = std::isfinite(c) ? std::clamp(c - std::floor(c), 0.0F, 1.0F) : 0;
  }
  return point;
}

GarmentFrame garment_frame(const V3f& interpolated, const V3f& t, float handedness, float side,
                           const V3f& to_viewer, const V2f& slope) {
  const float turned = side * handedness;
  V3f normal = unit_or(interpolated, to_viewer * side) * side;
  if (slope != V2f(0, 0)) {
    const V3f along = across(normal, t);
    normal = along * (slope.x * side) + normal.cross(along) * (slope.y * side * turned) +
             normal * std::sqrt(std::max(1 - slope.length2(), 0.0F));
    normal = unit_or(normal, to_viewer);
  }
  if (const float cosine = normal.dot(to_viewer); cosine < horizon)
    normal = unit_or(normal + to_viewer * (horizon - cosine), to_viewer);
  const V3f tangent = across(normal, t);
  return {tangent, normal.cross(tangent) * turned, normal};
}

GarmentFrame garment_frame(const FrameScene& scene, const GarmentPoint& point, const V2f& slope) {
  return garment_frame(point.normal, point.tangent, scene.prepared.mesh.triangles[point.triangle].handedness,
                       point.is_back ? -1.0F : 1.0F, point.to_viewer, slope);
}

std::vector<ArrivingLight> lights_at(const FrameScene& scene, const GarmentPoint& point,
                                     const GarmentFrame& frame, bool through) {
  std::vector<ArrivingLight> lights;
  for (const Light& light : scene.view.options.lights) {
    const Illumination there = illumination_at(light, scene.prepared.origin + V3d(point.position));
    lights.push_back({frame.to_frame(V3f(there.direction)), there.irradiance, light.is_environment_part});
  }
  for (const ShadowMap& map : scene.view.shadows) {
    ArrivingLight& light = lights[map.view.light];
    // Transmitted light leaves the cloth on the light's side, so that it is not in its own shadow.
    const bool behind = through && !(light.direction.z > 0);
    light.irradiance *= shadow_visibility(map, point.position, behind ? -frame.normal : frame.normal,
                                          frame.to_world(light.direction));
  }
  return lights;
}

SmoothLight smooth_light_at(const FrameScene& scene, const GarmentPoint& point) {
  const std::span<const SmoothLight> vertices = scene.view.vertex_lights;
  if (vertices.empty()) return *scene.view.options.smooth_light;
  SmoothLight light;
  const auto& corners = scene.prepared.mesh.triangles[point.triangle].corners;
  for (std::size_t corner = 0; corner < 3; ++corner)
    for (std::size_t k = 0; k < smooth_function_count; ++k)
      light.coefficients[k] += vertices[corners[corner]].coefficients[k] * point.barycentrics[corner];
  return light;
}

float smooth_light_visibility(const FrameScene& scene, const SmoothLight& at_point, const V3f& normal) {
  if (scene.view.vertex_lights.empty()) return 1;
  const V3f seen = mean_radiance(at_point, normal);
  const V3f all = mean_radiance(*scene.view.options.smooth_light, normal);
  const float sum = all.x + all.y + all.z;
  return sum > 0 ? std::clamp((seen.x + seen.y + seen.z) / sum, 0.0F, 1.0F) : 1.0F;
}

PbrValues pbr_values(const PbrPixel& pixel) {
  const auto& words = pixel.packed_values;
  PbrValues values;
  values.slope = V2f(signed_fraction(words[0]), signed_fraction(words[0] >> 16U));
  values.metallic = fraction(words[1]);
  values.roughness = fraction(words[1] >> 16U);
  values.emission = V3f(half_number(words[2]), half_number(words[2] >> 16U), half_number(words[3]));
  values.occlusion = half_number(words[3] >> 16U);
  return values;
}

}  // namespace selvedge
