#include "viewer/hybrid/probe.h"

#include <algorithm>
#include <cmath>

#include "format/base/parallel.h"

namespace selvedge {
namespace {

/// Change per pixel of the texture coordinates of a lane, along u and v.
V2d slope_of(const PixelBlock& block, std::size_t lane) {
  const V2d right(block.uv_right(lane));
  const V2d up(block.uv_up(lane));
  return {std::hypot(right.x, up.x), std::hypot(right.y, up.y)};
}

/// Pixels per texel at which lines begin to appear, and at which they are opaque.
constexpr double smallest_texel = 2.5;
constexpr double large_texel = 6;

/// Coverage of a pixel by a line along integer values of `coordinate` (in texels).
double line(double coordinate, double texels_per_pixel) {
  if (!(texels_per_pixel > 0)) return 0;
  const double size = 1 / texels_per_pixel;
  const double fade = std::clamp((size - smallest_texel) / (large_texel - smallest_texel), 0.0, 1.0);
  const double pixels_away = std::abs(coordinate - std::round(coordinate)) * size;
  return fade * std::clamp(1 - pixels_away, 0.0, 1.0);
}

OverlayPixel edge_pixel(const IndexScene& index, const PixelBlock& block, std::size_t lane) {
  const int fabric = index.materials[block.surface[lane]].fabric;
  if (fabric < 0) return {};
  const std::size_t level_index = block.texels[0].level[lane];
  const PackedLevel& level = index.fabrics[fabric].levels[level_index];
  const V2d uv(block.uv(lane));
  const V2d slope = slope_of(block, lane);
  const V2d size(level.width, level.height);
  const double texel = std::max(line(uv.x * size.x, slope.x * size.x), line(uv.y * size.y, slope.y * size.y));
  const double repeat = std::max(line(uv.x, slope.x), line(uv.y, slope.y));
  if (repeat > 0) return {255, 140, 20, static_cast<std::uint8_t>(std::lround(255 * repeat))};
  return {90, 220, 255, static_cast<std::uint8_t>(std::lround(200 * texel))};
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
    const int first_level = index.fabrics[probe.fabric].fabric->first_level();
    probe.uv = V2d(block.uv(0));
    probe.texels_per_pixel = slope_of(block, 0) * V2d(whole_texels(*index.fabrics[probe.fabric].fabric));
    for (std::size_t i = 0; i < block.texel_count; ++i) {
      const LaneTexels& texels = block.texels[i];
      if (!(texels.weight[0] > 0)) continue;
      const int width = levels[texels.level[0]].width;
      probe.texels.push_back({first_level + texels.level[0],
                              V2i(texels.texel[0] % width, texels.texel[0] / width), texels.weight[0]});
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

void draw_overlay(Overlay kind, const IndexScene& index, const std::array<DrawnSide, 2>& sides, int first_row,
                  int rows, std::vector<OverlayPixel>& overlay) {
  const int width = index.projected.width;
  parallel_for(0, rows, [&](int y) {
    OverlayPixel* row =
        overlay.data() + static_cast<std::ptrdiff_t>(index.projected.height - 1 - first_row - y) * width;
    std::fill_n(row, width, OverlayPixel{});
    PixelTriangles waiting;
    PixelBlock block;
    const auto flush = [&] {
      if (waiting.count == 0) return;
      find_texels(index, waiting, block);
      for (std::size_t lane = 0; lane < waiting.count; ++lane)
        row[waiting.x[lane]] = edge_pixel(index, block, lane);
      waiting.count = 0;
    };
    for (int x = 0; x < width; ++x) {
      const std::size_t i = y * width + x;
      const std::optional<NearestSurface> seen = nearest_surface(sides, i);
      if (kind == Overlay::triangles) {
        const auto differs = [&](std::size_t beside) {
          const std::optional<NearestSurface> other = nearest_surface(sides, beside);
          return seen.has_value() != other.has_value() || (seen && seen->triangle != other->triangle);
        };
        if ((x + 1 < width && differs(i + 1)) || (y + 1 < rows && differs(i + width)))
          row[x] = {255, 255, 255, 200};
        continue;
      }
      if (!seen) continue;
      const std::size_t lane = waiting.count;
      waiting.triangle[lane] = seen->triangle;
      waiting.back[lane] = seen->back;
      waiting.x[lane] = static_cast<std::uint16_t>(x);
      waiting.y[lane] = static_cast<std::uint16_t>(first_row + y);
      if (++waiting.count == lane_count) flush();
    }
    flush();
  });
}

}  // namespace selvedge
