// Rays through an endlessly repeated cell; the only place that knows Embree.
//
// A block of cells is built as triangles around the one at the origin. A ray that leaves the block sideways
// while still between the cell's lowest and highest point re-enters it shifted by whole periods, so every
// direction sees as many neighbours as it needs and memory does not depend on the steepest one.
#pragma once

#include <cstdint>
#include <memory>

#include "converter/mesh.h"

namespace selvedge {

/// What a ray met. Normals are unit and on the side that the ray came from.
struct SurfacePoint {
  V3f position{0, 0, 0};       ///< mm, in the cell (0 <= x < period.x, 0 <= y < period.y)
  V3f face_normal{0, 0, 1};    ///< of the triangle: what light transport uses
  V3f vertex_normal{0, 0, 1};  ///< interpolated over the triangle: what texel frames are made of
  V3f albedo{0, 0, 0};
};

class RayScene {
 public:
  /// Precondition: validate(mesh) holds.
  static Result<RayScene> create(const CellMesh& mesh, const std::string& name);
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;
  ~RayScene();

  /// Of one cell; the lowest point lies at z = 0, whatever height the mesh came with.
  const Box& bounds() const;
  V2d period() const;

  /// First surface along the ray from `origin` (anywhere; mm) in unit `direction`; false where there is none.
  bool trace(const V3d& origin, const V3d& direction, SurfacePoint& point) const;

  /// Whether anything lies between a surface point (moved off the surface along its face normal) and the sky
  /// or the void in unit `direction`.
  bool occluded(const SurfacePoint& point, const V3f& direction) const;

  /// The origin of a ray that leaves the surface at this point.
  V3d leave(const SurfacePoint& point) const;

 private:
  struct State;
  explicit RayScene(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace selvedge
