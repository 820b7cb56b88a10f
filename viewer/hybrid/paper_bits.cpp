#include "viewer/hybrid/paper_bits.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace selvedge {
namespace {

/// Texels per side that red and green can index.
constexpr int side_limit = 256;
/// Difference of adjacent levels in blue, of 255: levels are 0, 0.1, 0.2 and so on.
constexpr float level_step = 25.5F;
/// Shorter vectors are not unit vectors of 8 bits: the tangent is missing.
constexpr float min_tangent2 = 0.25F;

/// A component n of a direction is coded as (n + 1) / 2; its error is at most 1/255.
float rounded(float n) { return std::round(std::clamp((n + 1) / 2, 0.0F, 1.0F) * 255) / 127.5F - 1; }

void round_lane(LaneDirections& d, std::size_t lane) {
  d.x[lane] = rounded(d.x[lane]);
  d.y[lane] = rounded(d.y[lane]);
  d.z[lane] = rounded(d.z[lane]);
}

/// The middle of the texel, of `size` along this axis, at coordinate c in [0, 1].
float middle_of_texel(float c, int size) {
  const auto count = static_cast<float>(size);
  return (std::clamp(std::floor(c * count), 0.0F, count - 1) + 0.5F) / count;
}

}  // namespace

void round_to_paper_bits(const IndexScene& scene, PixelBlock& block, TexelInputs& texels) {
  block.yarn = {};
  for (std::size_t lane = 0; lane < lane_count; ++lane) {
    const int fabric = scene.materials[block.surface[lane]].fabric;
    if (fabric < 0) continue;
    round_lane(block.normal, lane);
    round_lane(block.tangent, lane);
    LaneDirections& t = block.tangent;
    const float length2 = t.x[lane] * t.x[lane] + t.y[lane] * t.y[lane] + t.z[lane] * t.z[lane];
    if (!(length2 > min_tangent2)) t.x[lane] = t.y[lane] = t.z[lane] = 0;

    if (scene.levels.blend) {
      const float blue = std::round((texels.lower[lane] + texels.weight[lane]) * level_step) / level_step;
      texels.weight[lane] = std::clamp(blue - texels.lower[lane], 0.0F, 1.0F);
    } else if (texels.weight[lane] > 0) {
      texels.lower[lane] = texels.upper[lane];
      texels.weight[lane] = 0;
    }
    const std::vector<PackedLevel>& levels = scene.fabrics[fabric].levels;
    const PackedLevel& finer = levels[static_cast<std::size_t>(texels.lower[lane])];
    texels.u[lane] = middle_of_texel(texels.u[lane], finer.width);
    texels.v[lane] = middle_of_texel(texels.v[lane], finer.height);
  }
}

Result<void> check_paper_fabrics(const Scene& scene, const Materials& materials,
                                 const std::vector<Fabric>& fabrics, std::vector<std::string>& remarks) {
  for (std::size_t i = 0; i < fabrics.size(); ++i) {
    if (std::ranges::find(materials.surfaces, static_cast<int>(i), &SurfaceMaterial::fabric) ==
        materials.surfaces.end())
      continue;
    const std::string name = i < scene.fabrics.size() ? scene.fabrics[i].name : scene.file;
    const auto refuse = [&](const std::string& reason) {
      return fail(Code::option_out_of_range, name, "--path",
                  fmt::format("paper: {}; --path hybrid draws it", reason));
    };
    const FabricLevel& finest = fabrics[i].levels.front();
    if (finest.width > side_limit || finest.height > side_limit)
      return refuse(
          fmt::format("{} x {} texels; 8 bits index {} a side", finest.width, finest.height, side_limit));
    for (const FabricLevel& level : fabrics[i].levels) {
      if (level.has(LayerKind::light)) return refuse("the fabric has a light table");
      if (level.has(LayerKind::products)) return refuse("the fabric has products");
    }
    if (finest.yarns())
      remarks.push_back(fmt::format("{}: --path paper draws level 0 in place of the yarn", name));
  }
  return {};
}

}  // namespace selvedge
