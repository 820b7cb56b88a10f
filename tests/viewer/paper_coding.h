// Frames as the paper's passes code them in 8 bits, for the tests of its path.
#pragma once

#include <vector>

#include "tests/require.h"
#include "tests/viewer/shapes.h"
#include "viewer/paper/layers.h"
#include "viewer/render.h"

namespace selvedge::test {

/// Half a step of (n + 1) / 2 in 8 bits, in n; and what floats round before that.
inline constexpr double half_step = 1.0 / 255 + 1e-5;

/// The nearest surfaces as the passes show them.
struct Coding {
  V2i size;
  Camera camera;
  MergedSurfaces mesh;
  PaperKinds kinds;
  PaperFrames frames;
  std::vector<PackedFabric> packed;
};

/// Rows first_row ... of the frame, counted from its bottom; all of them where `rows` is 0.
inline Coding code(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera,
                   const V2i& size, const LevelOptions& levels, int first_row = 0, int rows = 0) {
  Coding result{size, camera, {}, {}, {}, {}};
  const auto surfaces = need(build_surfaces(scene, V3d(0, 0, 0)));
  std::vector<std::string> remarks;
  const auto materials = need(materials_of(scene, surfaces, fabrics.size(), remarks));
  const auto kinds = need(paper_kinds(scene, surfaces, materials, fabrics, remarks));
  result.kinds = kinds;
  result.mesh = merge(surfaces);
  for (const Fabric& fabric : fabrics) result.packed.push_back(pack(fabric));
  const auto context = need(make_osmesa_context());
  need(context->make_current());
  const auto gl = need(load_gl_functions(*context));
  const auto pass = need(PaperPass::create(gl, result.mesh, materials.surfaces, result.kinds, fabrics,
                                           {size.x, size.y, rows == 0 ? size.y : rows}));
  need(pass->draw(clip_matrix(camera, V3d(0, 0, 0)), first_row, 0, levels));
  pass->read(result.frames);
  return result;
}

/// From 25 degrees aside, around the cube [-1, 1]^3.
inline Camera seen(double elevation, double aspect, double zoom = 1) {
  CameraOptions options;
  options.elevation = elevation;
  options.azimuth = 25;
  options.zoom = zoom;
  const std::vector<V3d> points{V3d(-1), V3d(1)};
  return need(make_camera(points, aspect, options));
}

}  // namespace selvedge::test
