// Private state of RayScene: its mesh, its block of cells and Embree's handles.
#pragma once

#include "converter/light/cell_walk.h"
#include "converter/light/ray_scene.h"

namespace selvedge {

/// Cells on each side of the middle one that a ray crosses before it is shifted back. More cost memory, fewer
/// cost restarts; one suffices for most rays in a cell that is thinner than wide.
inline constexpr int block_reach = 1;

/// Geometries of the scene, in the order in which they are attached.
inline constexpr unsigned triangle_geometry = 0;
inline constexpr unsigned hair_geometry = 1;

/// First point of the piece of a hair that a triangle of the hairs' geometry is of; two make a piece.
inline int hair_point_of(const Hairs& hairs, unsigned primitive) {
  constexpr int pieces = Hairs::points_each - 1;
  const int piece = static_cast<int>(primitive / 2 % (pieces * hairs.roots.size()));
  return piece / pieces * Hairs::points_each + piece % pieces;
}

struct RaySceneState {
  RaySceneState() = default;
  RaySceneState(const RaySceneState&) = delete;
  RaySceneState& operator=(const RaySceneState&) = delete;
  ~RaySceneState() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Box bounds;  // of one cell
  CellMesh mesh;
  int ground_triangle = 0;  // the first one
  CellBlock block;
  bool open = false;  // RayScene::is_open()
  double offset = 0;  // offset of rays from the surface that they leave
};

}  // namespace selvedge
