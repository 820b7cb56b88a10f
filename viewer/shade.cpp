#include "viewer/shade.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "format/parallel.h"

namespace selvedge {
namespace {

/// Smallest cosine between view and normal after bending.
constexpr float horizon = 0.01F;

/// What is left to be seen when a pixel counts as opaque.
constexpr float opaque_rest = 0.5F / 255;

V3f unit_or(const V3f& v, const V3f& otherwise) {
  const float length = v.length();
  return std::isfinite(length) && length > 0 ? v / length : otherwise;
}

/// Keeps a lobe that overflowed from spreading as NaN through sums and filters.
float tame(float radiance) { return radiance >= 0 ? std::min(radiance, 1e30F) : 0.0F; }

/// One texel under all lights.
Shading shade_texel(const Fabric& fabric, int level_index, int x, int y, const GarmentFrame& frame,
                    const V3f& view, std::span<const Light> lights) {
  const int k = std::min(level_index, static_cast<int>(fabric.levels.size()) - 1);
  const FabricLevel& level = fabric.levels[static_cast<std::size_t>(k)];
  const int i = std::min(x, level.width - 1);
  const int j = std::min(y, level.height - 1);
  if (lights.empty()) return evaluate(fabric, k, i, j, V3f(0, 0, -1), view);
  Shading sum;
  for (const Light& light : lights) {
    const Shading one = evaluate(fabric, k, i, j, frame.into(V3f(light.direction)), view);
    sum.alpha = one.alpha;
    sum.radiance += one.radiance * light.irradiance;
  }
  return sum;
}

Shading shade_lambert(const V4f& colour, const GarmentFrame& frame, std::span<const Light> lights) {
  Shading sum;
  sum.alpha = std::clamp(colour.w, 0.0F, 1.0F);
  for (const Light& light : lights) {
    const float cosine = std::max(0.0F, frame.normal.dot(V3f(light.direction)));
    sum.radiance += light.irradiance * cosine;
  }
  sum.radiance *= V3f(colour.x, colour.y, colour.z) * std::numbers::inv_pi_v<float>;
  return sum;
}

Shading shade_pixel(const ShadingScene& scene, const PixelLayer& layer, std::size_t i, const V3f& view) {
  const auto& marks = layer.marks[i];
  const V4f& normal = layer.normal[i];
  const V4f& surface = layer.surface[i];
  const SurfaceLook& look = scene.looks[marks[0] - 1U];
  const V4f tangent = look.fabric >= 0 ? surface : V4f(0, 0, 0, 1);
  const GarmentFrame frame = garment_frame(V3f(normal.x, normal.y, normal.z), tangent, marks[3] != 0, view);
  if (look.fabric < 0) return shade_lambert(surface, frame, scene.lights);

  const Fabric& fabric = scene.fabrics[static_cast<std::size_t>(look.fabric)];
  const V3f in_frame = frame.into(view);
  const auto& texels = layer.texels[i];
  Shading shading = shade_texel(fabric, marks[1], texels[0], texels[1], frame, in_frame, scene.lights);
  if (marks[1] != marks[2] && normal.w > 0) {
    const Shading second = shade_texel(fabric, marks[2], texels[2], texels[3], frame, in_frame, scene.lights);
    shading = blend(shading, second, normal.w);
  }
  if (!look.keeps_opacity) shading.alpha = 1;
  return shading;
}

}  // namespace

GarmentFrame garment_frame(const V3f& normal, const V4f& tangent, bool seen_from_back, const V3f& view) {
  GarmentFrame frame;
  frame.normal = unit_or(normal, seen_from_back ? -view : view);
  if (seen_from_back) frame.normal = -frame.normal;
  const float cosine = frame.normal.dot(view);
  if (cosine < horizon) frame.normal = unit_or(frame.normal + view * (horizon - cosine), view);
  const V3f t(tangent.x, tangent.y, tangent.z);
  frame.tangent = unit_or(t - frame.normal * frame.normal.dot(t), V3f(0, 0, 0));
  if (frame.tangent == V3f(0, 0, 0)) frame.tangent = tangent_of(frame.normal);
  const bool left_handed = (tangent.w < 0) != seen_from_back;
  frame.up = frame.normal.cross(frame.tangent) * (left_handed ? -1.0F : 1.0F);
  return frame;
}

LayerCount shade_layer(const ShadingScene& scene, const PixelLayer& layer, int first_row,
                       std::span<V4f> pixels, std::span<std::uint8_t> finished) {
  std::vector<LayerCount> rows(static_cast<std::size_t>(layer.rows));
  parallel_for(0, layer.rows, [&](int row) {
    LayerCount count;
    for (int x = 0; x < layer.width; ++x) {
      const std::size_t i =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(layer.width) + static_cast<std::size_t>(x);
      if (layer.marks[i][0] == 0) {
        finished[i] = 1;
        continue;
      }
      const V2d image_point((2.0 * x + 1) / scene.width - 1,
                            (2.0 * (first_row + row) + 1) / scene.height - 1);
      const V3f view(view_direction(scene.camera, image_point));
      const Shading shading = shade_pixel(scene, layer, i, view);
      V4f& pixel = pixels[i];
      const float share = (1 - pixel.w) * shading.alpha;
      pixel += V4f(share * tame(shading.radiance.x), share * tame(shading.radiance.y),
                   share * tame(shading.radiance.z), share);
      finished[i] = 1 - pixel.w < opaque_rest ? 1 : 0;
      ++count.covered;
      if (finished[i] == 0) ++count.open;
    }
    rows[static_cast<std::size_t>(row)] = count;
  });
  LayerCount sum;
  for (const LayerCount& row : rows) {
    sum.covered += row.covered;
    sum.open += row.open;
  }
  return sum;
}

}  // namespace selvedge
