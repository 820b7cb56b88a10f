#include "viewer/paper/layers.h"

#include <algorithm>
#include <cmath>

#include "format/base/parallel.h"

namespace selvedge {
namespace {

/// Number of rows that one task shades.
constexpr int rows_per_task = 4;

/// Shorter vectors are not 8-bit unit vectors: the tangent was missing.
constexpr float min_tangent2 = 0.25F;

/// The texel of a level with `target` texels at the centre of texel `i` of `source`.
int texel_in(int i, int source, int target) { return (2 * i + 1) * target / (2 * source); }

void set_texel(LaneTexels& target, std::size_t lane, int level, int texel, float weight) {
  target.level[lane] = level;
  target.texel[lane] = texel;
  target.weight[lane] = weight;
}

}  // namespace

void add_pixel(const PaperFrames& frames, std::size_t i, const PaperKinds& kinds,
               std::span<const PackedFabric> fabrics, bool blend, const V2i& size, const V2i& pixel,
               PixelBlock& block) {
  const std::size_t lane = block.count++;
  const std::uint8_t mark = frames.normals[i][3];
  const V3f n = decode_direction(frames.normals[i]);
  const V3f t = decode_direction(frames.tangents[i]);
  const float has_tangent = t.length2() > min_tangent2 ? 1.0F : 0.0F;
  block.x[lane] = static_cast<std::uint16_t>(pixel.x);
  block.y[lane] = static_cast<std::uint16_t>(pixel.y);
  block.from_middle_x[lane] = static_cast<float>(pixel.x) + 0.5F - 0.5F * static_cast<float>(size.x);
  block.from_middle_y[lane] = static_cast<float>(pixel.y) + 0.5F - 0.5F * static_cast<float>(size.y);
  block.surface[lane] = static_cast<std::uint32_t>(decode_kind(mark));
  block.normal.x[lane] = n.x;
  block.normal.y[lane] = n.y;
  block.normal.z[lane] = n.z;
  block.tangent.x[lane] = t.x * has_tangent;
  block.tangent.y[lane] = t.y * has_tangent;
  block.tangent.z[lane] = t.z * has_tangent;
  block.handedness[lane] = frames.tangents[i][3] < 128 ? -1.0F : 1.0F;
  block.side[lane] = decode_back(mark) ? -1.0F : 1.0F;

  const SurfaceMaterial& kind = kinds.kinds[block.surface[lane]];
  const std::vector<PackedLevel>& levels = fabrics[kind.fabric].levels;
  const Coded& texel = frames.texels[i];
  const float level = decode_level(texel[2]);
  const auto last = static_cast<int>(levels.size()) - 1;
  // By rounding to 8 bits, blue may give another level than red and green.
  const int number = blend ? texel[3] : static_cast<int>(std::lround(level));
  const int second = std::min(number + 1, last);
  const float part = blend ? std::clamp(level - static_cast<float>(number), 0.0F, 1.0F) : 0.0F;
  const PackedLevel& fine = levels[number];
  const PackedLevel& coarse = levels[second];
  const int x = texel_in(texel[0], fine.width, coarse.width);
  const int y = texel_in(texel[1], fine.height, coarse.height);
  set_texel(block.texels[0], lane, number, texel[1] * fine.width + texel[0], 1 - part);
  set_texel(block.texels[1], lane, second, y * coarse.width + x, part);
}

LayerCount shade_round(const PaperFrames& frames, const PaperKinds& kinds, bool blend,
                       const ShadingScene& shading, const BandPixels& pixels) {
  const int tasks = (pixels.rows + rows_per_task - 1) / rows_per_task;
  std::vector<LayerCount> counts(tasks);
  const V2i size(shading.width, shading.height);
  parallel_for(0, tasks, [&](int task) {
    LayerCount& count = counts[task];
    PixelBlock block;
    block.texel_count = 2;
    ShadingScratch scratch;
    const auto paint = [&] {
      if (block.count == 0) return;
      for (std::size_t lane = block.count; lane < lane_count; ++lane)
        block.texels[0].weight[lane] = block.texels[1].weight[lane] = 0;
      const LaneShading light = shade(shading, block, scratch);
      for (std::size_t lane = 0; lane < block.count; ++lane) {
        V4f& pixel = pixels.at(block.x[lane], block.y[lane] - pixels.first_row);
        pixel += V4f(light.red[lane], light.green[lane], light.blue[lane], light.alpha[lane]) * (1 - pixel.w);
      }
      count.evaluated += static_cast<std::int64_t>(block.count);
      block.count = 0;
    };
    for (int y = task * rows_per_task; y < std::min((task + 1) * rows_per_task, pixels.rows); ++y) {
      for (int x = 0; x < pixels.width; ++x) {
        const std::size_t i = y * pixels.width + x;
        if (frames.normals[i][3] == 0) continue;
        ++count.covered;
        if (!is_open(pixels.at(x, y))) continue;
        add_pixel(frames, i, kinds, shading.fabrics, blend, size, V2i(x, pixels.first_row + y), block);
        if (block.count == lane_count) paint();
      }
    }
    paint();
  });
  LayerCount sum;
  for (const LayerCount& count : counts) sum += count;
  if (sum.evaluated > 0) sum.layers = 1;
  return sum;
}

}  // namespace selvedge
