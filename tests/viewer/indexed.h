// The nearest surfaces of a scene as the viewer's own stages find them, up to the texels of every pixel.
#pragma once

#include <memory>
#include <vector>

#include "tests/require.h"
#include "tests/viewer/shapes.h"
#include "viewer/gl/context.h"
#include "viewer/hybrid/layers.h"
#include "viewer/scene/materials.h"

namespace selvedge::test {

struct Indexed {
  int width = 0;
  int height = 0;
  MergedSurfaces mesh;
  std::vector<SurfaceMaterial> materials;
  std::vector<PackedFabric> packed;
  ProjectedVertices projected;
  std::vector<PixelBlock> blocks;  ///< every covered pixel in one lane of one of them
};

/// Rows first_row ... of the frame, counted from its bottom; all of them where `rows` is 0.
inline Indexed index_nearest(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
                             int width, int height, const LevelOptions& levels, int first_row = 0,
                             int rows = 0, bool paper_bits = false) {
  Indexed result;
  result.width = width;
  result.height = height;
  const std::vector<Surface> surfaces = need(build_surfaces(scene, V3d(0, 0, 0)));
  std::vector<std::string> remarks;
  const Materials materials = need(materials_of(scene, surfaces, fabrics.size(), remarks));
  result.materials = materials.surfaces;
  result.mesh = merge(surfaces);
  for (const Fabric& fabric : fabrics) result.packed.push_back(pack(fabric));
  result.projected = project(result.mesh, clip_matrix(camera, V3d(0, 0, 0)), width, height);

  const auto context = need(make_osmesa_context());
  need(context->make_current());
  const GlFunctions gl = need(load_gl_functions(*context));
  const FrameTiles where{first_row, rows == 0 ? height : rows, {}};
  const auto pass = need(VisibilityPass::create(gl, result.mesh, materials, {width, height, where.rows}));
  pass->place(result.projected);
  const TriangleLists lists = list_bands(result.mesh, result.projected, result.materials, height).front();
  std::array<DrawnSide, 2> sides;
  sides[0].list = lists.front;
  sides[1].list = lists.back;
  for (int side = 0; side < 2; ++side) {
    DrawnSide& drawn = sides[side];
    need(pass->draw(side, 0, first_row, drawn.list));
    pass->read(side, 0, where, drawn.seen);
  }
  const IndexScene index{result.mesh, result.projected, result.materials, result.packed, levels, paper_bits};
  PixelTriangles waiting;
  const auto flush = [&] {
    if (waiting.count == 0) return;
    result.blocks.emplace_back();
    find_texels(index, waiting, result.blocks.back());
    waiting.count = 0;
  };
  for (int y = 0; y < where.rows; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y * width + x);
      const std::size_t side = sides[1].seen.depth[i] < sides[0].seen.depth[i] ? 1 : 0;
      const DrawnSide& drawn = sides[side];
      if (!(drawn.seen.depth[i] < 1)) continue;
      const std::size_t lane = waiting.count++;
      waiting.x[lane] = static_cast<std::uint16_t>(x);
      waiting.y[lane] = static_cast<std::uint16_t>(first_row + y);
      waiting.triangle[lane] = drawn.list[drawn.seen.triangles[i]];
      waiting.back[lane] = side == 1;
      if (waiting.count == lane_count) flush();
    }
  }
  flush();
  return result;
}

/// body(block, lane) for every covered pixel.
template <class Body>
void each_pixel(const Indexed& indexed, const Body& body) {
  for (const PixelBlock& block : indexed.blocks) {
    for (std::size_t lane = 0; lane < block.count; ++lane) body(block, lane);
  }
}

/// The mean level of a pixel's texels.
inline double level_of(const PixelBlock& block, std::size_t lane) {
  float sum = 0;
  for (std::size_t k = 0; k < block.texel_count; ++k) {
    const float weight = block.texels[k].weight[lane];
    if (weight > 0) sum += weight * static_cast<float>(block.texels[k].level[lane]);
  }
  return static_cast<double>(sum);
}

}  // namespace selvedge::test
