// Traces rays through an endlessly repeated cell with Embree.
//
// Embree holds the triangles of a block of cells around the origin. A ray that leaves the block sideways,
// while still between the cell's lowest and highest point, re-enters it shifted by whole periods: memory does
// not depend on how grazing a ray is.
//
// Hairs lie beside the triangles as ribbons of triangles that turn about themselves: as wide as a round hair
// on average, and shaded as one. Of the rays that meet a hair, its fraction `passed` goes on as if it was not
// there; which ones, is drawn from the ray and the hair. So opacity, light and shadow count a hair's cover
// less what it lets pass, and a ray is always decided alike.
#pragma once

#include <memory>

#include "converter/mesh/cell_mesh.h"

namespace selvedge {

/// The point where a ray met the surface. Normals are unit vectors on the ray's side.
struct SurfacePoint {
  V3f position{0, 0, 0};     ///< mm, in the cell (0 <= x < period.x, 0 <= y < period.y)
  V3f face_normal{0, 0, 1};  ///< of the triangle: decides about light and shadow
  int triangle = 0;          ///< index into RayScene::mesh()
  float u = 0;               ///< weight of the triangle's second corner
  float v = 0;               ///< weight of its third corner
  V3f view{0, 0, 0};         ///< unit, towards the ray's origin; zero: no ray met it
  /// First point of the piece of a hair in RayScene::mesh().hairs; -1: the triangle itself. A point on a hair
  /// has the middle of the hair's root as its place on the triangle.
  int hair_point = -1;
  bool is_back = false;  ///< the ray came from the side that sees the corners in clockwise order
};

/// The same place on the other side of the surface, where no ray met it.
inline SurfacePoint other_side(SurfacePoint point) {
  point.face_normal = -point.face_normal;
  point.view = V3f(0, 0, 0);
  point.is_back = !point.is_back;
  return point;
}

struct RaySceneState;

class RayScene {
 public:
  /// Precondition: validate(mesh) holds.
  static Result<RayScene> create(const CellMesh& mesh, const std::string& name);

  /// Bounds of one cell without hairs; the lowest point lies at z = 0, whatever the mesh's own height.
  const Imath::Box3f& bounds() const;
  V2d period() const;
  /// The cell as it is traced: shifted by whole periods, its lowest point at z = 0.
  const CellMesh& mesh() const;
  /// Whether light passes through the walls of yarn, which is closed then: light reaches the inside through
  /// walls alone.
  bool is_translucent() const { return !mesh().transmission.empty(); }

  /// Finds the first surface along the ray from `origin` (anywhere, mm) in unit `direction`; false: none.
  bool trace(const V3d& origin, const V3d& direction, SurfacePoint& point) const;

  /// Whether a ray from a surface point (offset along its face normal) in unit `direction` meets anything.
  bool is_occluded(const SurfacePoint& point, const V3f& direction) const;

  /// The origin of a ray that leaves the surface at this point.
  V3d offset_origin(const SurfacePoint& point) const;
  /// The same on the side that `direction` leads to.
  V3d offset_origin(const SurfacePoint& point, const V3d& direction) const {
    return offset_origin(direction.dot(V3d(point.face_normal)) < 0 ? other_side(point) : point);
  }

  /// Interpolates a value per vertex of the mesh. `Value` has the operations of a vector space.
  template <class Value>
  Value interpolate(const std::vector<Value>& values, const SurfacePoint& p) const {
    const V3i& corner = mesh().triangles[p.triangle];
    return values[corner.x] * (1 - p.u - p.v) + values[corner.y] * p.u + values[corner.z] * p.v;
  }
  /// Linear, in [0, 1].
  V3f albedo(const SurfacePoint& point) const { return interpolate(mesh().albedo, point); }
  /// Unit, interpolated over the triangle, on the face normal's side: the normal of texel frames.
  V3f vertex_normal(const SurfacePoint& point) const;

 private:
  explicit RayScene(std::shared_ptr<RaySceneState> state) : state_(std::move(state)) {}
  std::shared_ptr<RaySceneState> state_;
};

}  // namespace selvedge
