#include "viewer/hybrid/paper_bits.h"

#include <algorithm>
#include <cmath>

#include "format/fabric/evaluate.h"
#include "format/fabric/footprint.h"

namespace selvedge {
namespace {

/// Difference of adjacent levels in blue, of 255.
constexpr float level_step = 25.5F;
/// Shorter vectors are not unit vectors of 8 bits: the tangent is missing.
constexpr float min_tangent2 = 0.25F;

/// The middle of the texel, of `size` along this axis, at coordinate c in [0, 1].
float middle_of_texel(float c, int size) {
  const auto count = static_cast<float>(size);
  return (std::clamp(std::floor(c * count), 0.0F, count - 1) + 0.5F) / count;
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

}  // namespace selvedge
