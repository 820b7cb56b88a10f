#include "viewer/hybrid/shade.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "format/fabric/evaluate.h"
#include "format/fabric/footprint.h"
#include "viewer/light/pbr_brdf.h"

namespace selvedge {
namespace {

/// Prevents NaN in sums and filters from lobes that overflowed.
float tame(float radiance) { return radiance >= 0 ? std::min(radiance, 1e30F) : 0.0F; }

V4f times_opacity(const V3f& radiance, float alpha) {
  return {tame(radiance.x * alpha), tame(radiance.y * alpha), tame(radiance.z * alpha), alpha};
}

/// Occlusion of a mirror image (Lagarde and de Rousiers 2014).
float mirrored_occlusion(float nv, float occlusion, float roughness) {
  return std::clamp(std::pow(nv + occlusion, std::exp2(-16 * roughness - 1)) - 1 + occlusion, 0.0F, 1.0F);
}
/// Where a lobe gathers light: the mirrored view, of rough surfaces nearer to the normal.
V3f mirrored_view(const V3f& normal, const V3f& view, float roughness) {
  const V3f mirrored = normal * (2 * normal.dot(view)) - view;
  const float alpha = roughness * roughness;
  return (mirrored + (normal - mirrored) * (alpha * alpha)).normalized();
}

/// An environment is its mean and its mirror image; its lamps, which the mirror image has, add to the mean
/// alone. An occlusion texture and what the vertices do not see describe the same mesh: the darker one
/// counts, towards the normal for the mean, towards the mirrored view for the mirror image. Lamps whose
/// shadows are drawn have no other.
V3f shade_pbr(const FrameScene& scene, const GarmentPoint& point, const PbrPixel& pixel) {
  const PbrValues values = pbr_values(pixel);
  const V3f base(pixel.colour.x, pixel.colour.y, pixel.colour.z);
  if (scene.prepared.materials.pbr[point.surface].unlit) return base * std::numbers::inv_pi_v<float>;
  const GarmentFrame frame = garment_frame(scene, point);
  const float side = point.is_back ? -1.0F : 1.0F;
  const V3f normal =
      V3f(values.slope.x * side, values.slope.y * side, std::sqrt(std::max(1 - values.slope.length2(), 0.0F)))
          .normalized();
  const V3f view = frame.to_frame(point.to_viewer);
  const PbrPoint material{base, values.metallic, values.roughness};
  V3f sum = values.emission;
  V3f mean(0, 0, 0);
  for (const ArrivingLight& light : lights_at(scene, point, frame, false)) {
    if (!light.is_environment_part) {
      sum += pbr_brdf(material, normal, view, light.direction) * light.irradiance;
      continue;
    }
    const float of_lamps =
        (scene.view.shadows.empty() ? values.occlusion : 1.0F) * std::numbers::inv_pi_v<float>;
    mean += light.irradiance * (std::max(normal.dot(light.direction), 0.0F) * of_lamps);
  }
  const float nv = std::abs(normal.dot(view));
  V3f mirrored(0, 0, 0);
  if (scene.view.options.smooth_light) {
    const SmoothLight around = smooth_light_at(scene, point);
    const V3f up = frame.to_world(normal);
    const V3f towards = frame.to_world(mirrored_view(normal, view, values.roughness));
    mean += mean_radiance(around, up) *
            std::min(1.0F, values.occlusion / std::max(smooth_light_visibility(scene, around, up), 1e-3F));
    mirrored = V3f(scene.view.options.mirrored_ambient_irradiance * std::numbers::inv_pi_v<float>);
    if (scene.view.reflections)
      mirrored += scene.view.reflections->at(V3d(towards).normalized(), values.roughness);
    mirrored *= std::min(smooth_light_visibility(scene, around, towards),
                         mirrored_occlusion(nv, values.occlusion, values.roughness));
  }
  const V2f fraction = environment_brdf(values.roughness, nv);
  return sum + pbr_environment(material, fraction.x, fraction.y, mean, mirrored);
}

/// Difference of adjacent levels in blue, of 255.
constexpr float level_step = 25.5F;
/// Shorter vectors are not unit vectors of 8 bits: the tangent is missing.
constexpr float min_tangent2 = 0.25F;

/// The middle of the texel, of `size` along this axis, at coordinate c in [0, 1].
float middle_of_texel(float c, int size) {
  const auto count = static_cast<float>(size);
  return (std::clamp(std::floor(c * count), 0.0F, count - 1) + 0.5F) / count;
}

/// Radiance and opacity of a fabric. Yarn shows as texels of level 0.
V4f shade_by_paper(const FrameScene& scene, const GarmentPoint& point) {
  const int number = scene.prepared.materials.surfaces[point.surface].fabric;
  const Fabric& fabric = scene.prepared.fabrics[number].seen_from(point.is_back);
  const PaperTexels texels = paper_texels(fabric, point, scene.view.options.levels.forced_level);
  GarmentPoint rounded = point;
  rounded.normal = round_to_paper_bits(point.normal);
  rounded.tangent = round_to_paper_bits(point.tangent);
  if (!(rounded.tangent.length2() > min_tangent2)) rounded.tangent = V3f(0, 0, 0);
  const GarmentFrame frame = garment_frame(scene, rounded);
  const bool through = fabric.find_side(Side::through) != nullptr;
  std::vector<ArrivingLight> lights = lights_at(scene, rounded, frame, through);
  if (scene.view.options.smooth_light) {
    const SmoothLight around = turned(smooth_light_at(scene, point), frame.tangent, frame.up, frame.normal);
    for (const CellLamp& lamp : lamps_of_smooth_light(around, 0))
      lights.push_back({lamp.direction, lamp.irradiance, true});
    if (through) {
      for (const CellLamp& lamp : lamps_of_smooth_light(mirrored(around), 0))
        lights.push_back({mirrored(lamp.direction), lamp.irradiance, true});
    }
  }
  const V3f view = frame.to_frame(point.to_viewer);
  V3f sum(0, 0, 0);
  float alpha = 0;
  for (const int next : {0, 1}) {
    const float weight = next == 0 ? 1 - texels.coarser_weight : texels.coarser_weight;
    if (!(weight > 0)) continue;
    const int level = texels.finer_level + next;
    const FabricLevel& stored = fabric.levels[level];
    const V2i at(wrap_texel(static_cast<double>(texels.uv.x), stored.width),
                 wrap_texel(static_cast<double>(texels.uv.y), stored.height));
    const float coverage = weight * evaluate(fabric, level, at.x, at.y, V3f(0, 0, 1), view).alpha;
    alpha += coverage;
    for (const ArrivingLight& light : lights)
      sum +=
          evaluate(fabric, level, at.x, at.y, light.direction, view).radiance * light.irradiance * coverage;
  }
  return {sum.x / std::max(alpha, 1e-9F), sum.y / std::max(alpha, 1e-9F), sum.z / std::max(alpha, 1e-9F),
          alpha};
}

}  // namespace

PaperTexels paper_texels(const Fabric& fabric, const GarmentPoint& point, int forced) {
  const auto last = static_cast<float>(fabric.levels.size() - 1);
  const V2f size(fabric.texels());
  const float by_size = std::log2(pixel_width_texels({point.duv_dx * size, point.duv_dy * size}));
  // Level 0 for NaN as well.
  const float wanted = forced >= 0 ? static_cast<float>(forced) : by_size;
  const float level = wanted > 0 ? std::min(wanted, last) : 0;
  PaperTexels texels;
  texels.finer_level = static_cast<int>(level);
  const float finer = std::floor(level);
  const float blue = std::round((finer + coarser_level_weight(level - finer)) * level_step) / level_step;
  texels.coarser_weight = finer < last ? std::clamp(blue - finer, 0.0F, 1.0F) : 0;
  const FabricLevel& stored = fabric.levels[texels.finer_level];
  texels.uv = {middle_of_texel(point.uv.x, stored.width), middle_of_texel(point.uv.y, stored.height)};
  return texels;
}

V3f round_to_paper_bits(const V3f& direction) {
  V3f result;
  for (int axis = 0; axis < 3; ++axis)
    result[axis] = std::round(std::clamp((direction[axis] + 1) / 2, 0.0F, 1.0F) * 255) / 127.5F - 1;
  return result;
}

V4f SurfaceLight::tinted(const V3f& tint) const {
  return {tame(reflected.x * tint.x + emitted.x), tame(reflected.y * tint.y + emitted.y),
          tame(reflected.z * tint.z + emitted.z), reflected.w};
}

SurfaceLight shade_pixel(const FrameScene& scene, TriangleSide seen, int x, int y, const PbrPixel& pixel) {
  const GarmentPoint point = garment_point(scene, seen, x, y);
  const SurfaceMaterial& material = scene.prepared.materials.surfaces[point.surface];
  if (material.fabric < 0)
    return {times_opacity(shade_pbr(scene, point, pixel), std::clamp(pixel.colour.w, 0.0F, 1.0F))};
  const V4f shaded = shade_by_paper(scene, point);
  const float alpha = material.keeps_opacity ? std::min(shaded.w, 1.0F) : 1.0F;
  return apply_material(scene, seen, x, y, pixel, times_opacity(V3f(shaded.x, shaded.y, shaded.z), alpha));
}

SurfaceLight apply_material(const FrameScene& scene, TriangleSide seen, int x, int y, const PbrPixel& pixel,
                            const V4f& cell) {
  const MergedTriangle& triangle = scene.prepared.mesh.triangles[seen / 2];
  const SurfaceMaterial& material = scene.prepared.materials.surfaces[triangle.surface];
  const PbrValues values = pbr_values(pixel);
  V3f light(cell.x, cell.y, cell.z);
  const bool occluded = material.has_occlusion_texture && values.occlusion < 1;
  if (!scene.is_paper && (material.has_normal_texture || occluded || scene.cells.has_uneven_light(seen))) {
    const GarmentPoint point = garment_point(scene, seen, x, y);
    const GarmentFrame bent =
        garment_frame(scene, point, material.has_normal_texture ? values.slope : V2f(0, 0));
    SmoothLight around;
    float left = 1;
    if (scene.view.options.smooth_light) {
      around = smooth_light_at(scene, point);
      if (occluded)
        left = std::min(
            1.0F, values.occlusion / std::max(smooth_light_visibility(scene, around, bent.normal), 1e-3F));
    }
    for (V3f& factor : around.coefficients) factor *= left;
    const float of_lamps = occluded && scene.view.shadows.empty() ? values.occlusion : 1.0F;
    light *= scene.cells.brightness_gain(seen, x, y, bent.normal, point.position,
                                         scene.view.options.smooth_light ? &around : nullptr, of_lamps);
  }
  if (material.is_tinted) light *= V3f(pixel.colour.x, pixel.colour.y, pixel.colour.z);
  const bool emits = scene.prepared.materials.emits(triangle.surface);
  return {V4f(light.x, light.y, light.z, cell.w), emits ? values.emission * cell.w : V3f(0, 0, 0)};
}

}  // namespace selvedge
