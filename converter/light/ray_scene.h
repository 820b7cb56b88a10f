// Rays through an endlessly repeated cell, traced by Embree.
//
// A block of cells is built as triangles around the one at the origin. A ray that leaves the block sideways
// while still between the cell's lowest and highest point re-enters it shifted by whole periods, so every
// direction sees as many neighbours as it needs and memory does not depend on the steepest one.
//
// Rays come singly or in packets of up to 16. Packets whose rays lie close together (one direction from
// neighbouring points, or neighbouring directions from one point) cost about a third.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "converter/mesh/cell_mesh.h"

namespace selvedge {

/// A point where a ray met the surface. Normals are unit and on the side that the ray came from.
struct SurfacePoint {
  V3f position{0, 0, 0};     ///< mm, in the cell (0 <= x < period.x, 0 <= y < period.y)
  V3f face_normal{0, 0, 1};  ///< of the triangle: the normal of light and shadow
  int triangle = 0;          ///< of the scene's mesh()
  float u = 0;               ///< weight of the triangle's second corner
  float v = 0;               ///< and of its third
  bool back = false;         ///< met from the side from which the corners run clockwise
};

inline constexpr std::size_t packet_size = 16;
using PointPacket = std::array<SurfacePoint, packet_size>;

/// Where rays begin that leave the points of a packet: found once for many directions.
struct LeavingPacket {
  alignas(64) std::array<float, packet_size> x, y, z;
};

struct RaySceneState;

class RayScene {
 public:
  /// `ground`: albedo of a plane at the lowest point of the cell, on which everything lies; without it, rays
  /// that leave downwards meet nothing. Precondition: validate(mesh) holds.
  static Result<RayScene> create(const CellMesh& mesh, const std::string& name,
                                 std::optional<float> ground = {});
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;
  ~RayScene();

  /// Of one cell without the ground; the lowest point lies at z = 0, whatever height the mesh came with.
  const Box& bounds() const;
  V2d period() const;
  /// The cell as it is traced: moved by whole periods, lowest point at z = 0, the ground's triangles last.
  const CellMesh& mesh() const;
  bool is_ground(const SurfacePoint& point) const;

  /// First surface along the ray from `origin` (anywhere; mm) in unit `direction`; false where there is none.
  bool trace(const V3d& origin, const V3d& direction, SurfacePoint& point) const;
  /// The same for up to 16 origins and one direction. Bit i of the result: points[i] was met.
  std::uint32_t trace(std::span<const V3d> origins, const V3d& direction, PointPacket& points) const;
  /// The same for up to 16 directions from one origin.
  std::uint32_t trace(const V3d& origin, std::span<const V3d> directions, PointPacket& points) const;

  /// Whether anything lies between a surface point (moved off the surface along its face normal) and the sky
  /// or the void in unit `direction`.
  bool occluded(const SurfacePoint& point, const V3f& direction) const;
  /// The same for the points whose bit in `active` is set; other bits of the result are 0.
  std::uint32_t occluded(const LeavingPacket& points, const V3f& direction, std::uint32_t active) const;
  /// The same for up to 16 directions from one point.
  std::uint32_t occluded(const SurfacePoint& point, std::span<const V3f> directions,
                         std::uint32_t active) const;

  /// The origin of a ray that leaves the surface at this point.
  V3d leave(const SurfacePoint& point) const;
  /// Those of the points whose bit in `active` is set (one at least), the only ones to ask for later.
  LeavingPacket leave(const PointPacket& points, std::uint32_t active) const;

  /// A value per vertex of the mesh, interpolated. `Value` has the operations of a vector space.
  template <class Value>
  Value interpolate(const std::vector<Value>& values, const SurfacePoint& p) const {
    const V3i& corner = mesh().triangles[p.triangle];
    return values[corner.x] * (1 - p.u - p.v) + values[corner.y] * p.u + values[corner.z] * p.v;
  }
  /// Linear, in [0, 1].
  V3f albedo(const SurfacePoint& point) const { return interpolate(mesh().albedo, point); }
  /// Unit, interpolated over the triangle, on the face normal's side: what texel frames are made of.
  V3f vertex_normal(const SurfacePoint& point) const;

 private:
  explicit RayScene(std::unique_ptr<RaySceneState> state);
  std::unique_ptr<RaySceneState> state_;
};

}  // namespace selvedge
