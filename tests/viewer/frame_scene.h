// A frame before it is drawn, as the stages of the hybrid path take it.
#pragma once

#include <optional>
#include <vector>

#include "tests/require.h"
#include "tests/viewer/ray_caster.h"
#include "tests/viewer/shapes.h"
#include "viewer/hybrid/garment_point.h"
#include "viewer/scene/materials.h"

namespace selvedge::test {

class FrameOf {
 public:
  FrameOf(const Scene& scene, const std::vector<Fabric>& fabrics, const Camera& camera, const V2i& size)
      : camera_(camera),
        size_(size),
        prepared_(prepare(scene, fabrics)),
        view_{camera_, options_},
        projected_(project(prepared_.mesh, clip_matrix(camera_, V3d(0, 0, 0)), size.x, size.y)),
        cells_(prepared_) {}
  FrameOf(const FrameOf&) = delete;
  FrameOf& operator=(const FrameOf&) = delete;

  FrameScene scene() const { return {prepared_, view_, projected_, cells_}; }
  const MergedSurfaces& mesh() const { return prepared_.mesh; }

  /// body(surface, x, y) of every `step`th pixel that a ray sees, counted from the lower left.
  template <class Body>
  void each_pixel(int step, const Body& body) const {
    const RayCaster rays(prepared_.mesh, size_, camera_);
    for (int i = 0; i < size_.x * size_.y; i += step) {
      const std::optional<RayHit> hit = rays.cast(i % size_.x + 0.5, i / size_.x + 0.5);
      if (!hit) continue;
      const bool back =
          hit->normal.dot(camera_.position -
                          V3d(prepared_.mesh.positions[prepared_.mesh.triangles[hit->triangle].corners[0]])) <
          0;
      body(static_cast<TriangleSide>(2 * hit->triangle + (back ? 1 : 0)), i % size_.x, i / size_.x);
    }
  }

 private:
  static PreparedScene prepare(const Scene& scene, const std::vector<Fabric>& fabrics) {
    PreparedScene prepared;
    const std::vector<Surface> surfaces = need(build_surfaces(scene, V3d(0, 0, 0)));
    std::vector<std::string> remarks;
    prepared.materials = materials_of(scene, surfaces, remarks);
    prepared.mesh = merge(surfaces);
    for (const Fabric& fabric : fabrics) prepared.fabrics.emplace_back(fabric);
    return prepared;
  }

  Camera camera_;
  V2i size_;
  PreparedScene prepared_;
  DrawOptions options_;
  FrameView view_;
  ProjectedVertices projected_;
  CellPass cells_;
};

}  // namespace selvedge::test
