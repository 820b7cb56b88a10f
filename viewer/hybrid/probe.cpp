#include "viewer/hybrid/probe.h"

#include <cmath>

namespace selvedge {
namespace {

/// Change per pixel of the texture coordinates of a lane, along u and v.
V2d slope_of(const PixelBlock& block, std::size_t lane) {
  const V2d right(block.uv_right(lane));
  const V2d up(block.uv_up(lane));
  return {std::hypot(right.x, up.x), std::hypot(right.y, up.y)};
}

}  // namespace

std::optional<NearestSurface> nearest_surface(const std::array<DrawnSide, 2>& sides, std::size_t i) {
  const std::size_t side = sides[1].seen.depth[i] < sides[0].seen.depth[i] ? 1 : 0;
  if (!(sides[side].seen.depth[i] < 1)) return std::nullopt;
  return NearestSurface{sides[side].list[sides[side].seen.triangles[i]], side == 1};
}

PixelProbe probe_pixel(const IndexScene& index, const ShadingScene& shading, const PixelTriangles& pixels) {
  PixelBlock block;
  find_texels(index, pixels, block);
  PixelProbe probe;
  probe.pixel = V2i(block.x[0], index.projected.height - 1 - block.y[0]);
  probe.surface = block.surface[0];
  probe.triangle = pixels.triangle[0];
  probe.back = pixels.back[0];
  probe.position = seen_point(*shading.mesh, shading.origin, block, 0);
  probe.fabric = index.materials[probe.surface].fabric;
  if (probe.fabric >= 0) {
    const std::vector<PackedLevel>& levels = index.fabrics[probe.fabric].levels;
    probe.uv = V2d(block.uv(0));
    probe.texels_per_pixel = slope_of(block, 0) * V2d(index.fabrics[probe.fabric].fabric->texels());
    for (std::size_t i = 0; i < block.texel_count; ++i) {
      const LaneTexels& texels = block.texels[i];
      if (!(texels.weight[0] > 0)) continue;
      const int width = levels[texels.level[0]].width;
      probe.texels.push_back(
          {texels.level[0], V2i(texels.texel[0] % width, texels.texel[0] / width), texels.weight[0]});
    }
  }
  const LaneFrames frames = garment_frames(shading.camera, shading.width, shading.height, block);
  const auto first = [](const LaneDirections& d) { return V3f(d.x[0], d.y[0], d.z[0]); };
  probe.view = first(frames.view);
  ShadingScratch scratch;
  const LaneShading& light = shade(shading, block, scratch);
  for (const LaneLight& lane_light : scratch.block.lights)
    probe.lights.push_back(first(lane_light.direction));
  probe.alpha = light.alpha[0];
  if (probe.alpha > 0) probe.radiance = V3f(light.red[0], light.green[0], light.blue[0]) / probe.alpha;
  return probe;
}

}  // namespace selvedge
