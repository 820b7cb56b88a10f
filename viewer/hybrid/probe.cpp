#include "viewer/hybrid/probe.h"

#include <algorithm>
#include <cmath>

#include "format/fabric/evaluate.h"

namespace selvedge {

PixelProbe probe_pixel(const FrameScene& scene, TriangleSide seen, const V2i& pixel, const PbrPixel& pbr) {
  const GarmentPoint point = garment_point(scene, seen, pixel.x, pixel.y);
  PixelProbe probe;
  probe.pixel = V2i(pixel.x, scene.projected.height - 1 - pixel.y);
  probe.surface = point.surface;
  probe.triangle = point.triangle;
  probe.is_back = point.is_back;
  probe.position = scene.prepared.origin + V3d(point.position);
  probe.fabric = scene.prepared.materials.surfaces[probe.surface].fabric;
  bool through = false;
  if (probe.fabric >= 0) {
    const Fabric& fabric = scene.prepared.fabrics[probe.fabric].seen_from(point.is_back);
    through = fabric.find_side(Side::through) != nullptr;
    probe.uv = V2d(point.uv);
    const V2f repeats(std::hypot(point.duv_dx.x, point.duv_dy.x), std::hypot(point.duv_dx.y, point.duv_dy.y));
    probe.texels_per_pixel = V2d(repeats) * V2d(fabric.repeat_texels(0));
    const auto& yarns = fabric.levels.front().yarns();
    const V2f images = yarns ? repeats * V2f(yarns->tiles_per_repeat()) : repeats;
    const CellLevels levels = shown_levels(fabric, images, scene.view.options.levels.forced_level);
    const auto add = [&](int level, float weight) {
      if (!(weight > 0)) return;
      const V2i texels = fabric.repeat_texels(std::max(level, 0));
      probe.texels.push_back(
          {level, {wrap_texel(probe.uv.x, texels.x), wrap_texel(probe.uv.y, texels.y)}, weight});
    };
    add(-1, levels.yarn_weight);
    add(levels.finer_level, (1 - levels.yarn_weight) * (1 - levels.coarser_weight));
    add(levels.finer_level + 1, (1 - levels.yarn_weight) * levels.coarser_weight);
  }
  const GarmentFrame frame = garment_frame(scene, point);
  probe.to_viewer = frame.to_frame(point.to_viewer);
  for (const ArrivingLight& light : lights_at(scene, point, frame, through))
    probe.to_lights.push_back(light.direction);
  const V4f light = shade_surface(scene, seen, pixel, pbr);
  probe.alpha = light.w;
  if (probe.alpha > 0) probe.radiance = V3f(light.x, light.y, light.z) / probe.alpha;
  return probe;
}

}  // namespace selvedge
