#include "viewer/hybrid/yarn_points.h"

namespace selvedge {
namespace {

V3f direction_of(const LaneDirections& d, std::size_t lane) { return {d.x[lane], d.y[lane], d.z[lane]}; }

/// Radiance under all lights at a point of yarn, with its shadows.
V3f radiance_at(const Yarns& yarns, const YarnHit& hit, const V3f& view, std::span<const LaneLight> lights,
                std::size_t lane) {
  const YarnPoint point = yarns.point_at(hit);
  const LightTransfer transfer = yarns.transfer_at(point);
  V3f sum(0, 0, 0);
  for (const LaneLight& light : lights) {
    const V3f direction = direction_of(light.direction, lane);
    if (!(direction.z > 0) || !(light.share[lane] > 0)) continue;
    V3f f = indirect_light(transfer, direction);
    const V3f lit = yarns.direct(point, direction, view);
    if (lit != V3f(0, 0, 0) && !yarns.occluded(hit, point, direction)) f += lit;
    sum += f * light.irradiance * light.share[lane];
  }
  return sum;
}

}  // namespace

void add_yarn(const ShadingScene& scene, const PixelBlock& block, const LaneFrames& frames,
              std::span<const LaneLight> lights, LaneShading& sum) {
  const int n = scene.points;
  for (std::size_t lane = 0; lane < block.count; ++lane) {
    if (!(block.yarn[lane] > 0)) continue;
    const Fabric& fabric = *scene.fabrics[scene.materials[block.surface[lane]].fabric].fabric;
    const Yarns& yarns = *fabric.levels.front().yarns();
    const V3f view = direction_of(frames.view, lane);
    const float weight = block.yarn[lane] / static_cast<float>(n * n);
    for (int i = 0; i < n * n; ++i) {
      const int row = i / n;
      const float right = (static_cast<float>(i % n) + 0.5F) / static_cast<float>(n) - 0.5F;
      const float up = (static_cast<float>(row) + 0.5F) / static_cast<float>(n) - 0.5F;
      const V2f uv = block.uv(lane) + block.uv_right(lane) * right + block.uv_up(lane) * up;
      const auto hit = yarns.trace(V2d(uv), fabric.reference_height, view);
      if (!hit) continue;
      sum.alpha[lane] += weight;
      if (!(view.z > 0)) continue;
      const V3f radiance = radiance_at(yarns, *hit, view, lights, lane) * weight;
      sum.red[lane] += radiance.x;
      sum.green[lane] += radiance.y;
      sum.blue[lane] += radiance.z;
    }
  }
}

}  // namespace selvedge
