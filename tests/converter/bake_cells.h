// Cells whose light is known in closed form, for the tests of the bake.
#pragma once

#include "converter/mesh/cell_mesh.h"

namespace selvedge::test {

inline void add_quad(CellMesh& mesh, const V3f& a, const V3f& b, const V3f& c, const V3f& d, float albedo) {
  const int first = static_cast<int>(mesh.positions.size());
  const V3f normal = (b - a).cross(c - a).normalized();
  for (const V3f& p : {a, b, c, d}) {
    mesh.positions.push_back(p);
    mesh.normals.push_back(normal);
    mesh.albedo.emplace_back(albedo, albedo / 2, 0.0F);
  }
  mesh.triangles.emplace_back(first, first + 1, first + 2);
  mesh.triangles.emplace_back(first, first + 2, first + 3);
}

/// A floor over the cell's left `fraction`, `period` mm a side.
inline CellMesh floor_of(float period, float fraction, float albedo) {
  CellMesh mesh;
  mesh.period = V2d(period, period);
  const float x = period * fraction;
  add_quad(mesh, {0, 0, 0}, {x, 0, 0}, {x, period, 0}, {0, period, 0}, albedo);
  return mesh;
}

/// A floor and a wall of height `height` that stands on it along y at x = 0, both sides alike.
inline CellMesh fence(float period, float height, float floor_albedo, float ply_wall_albedo) {
  CellMesh mesh = floor_of(period, 1, floor_albedo);
  add_quad(mesh, {0, 0, 0}, {0, period, 0}, {0, period, height}, {0, 0, height}, ply_wall_albedo);
  return mesh;
}

/// Grooves along y: ridges of height `slope` * period / 2 at x = 0 and x = period, the valley between.
inline CellMesh groove(float period, float slope, float albedo) {
  CellMesh mesh;
  mesh.period = V2d(period, period);
  const float half = period / 2;
  const float height = slope * half;
  add_quad(mesh, {0, 0, height}, {half, 0, 0}, {half, period, 0}, {0, period, height}, albedo);
  add_quad(mesh, {half, 0, 0}, {period, 0, height}, {period, period, height}, {half, period, 0}, albedo);
  return mesh;
}

/// A floor, and high above it a plate with a slit: open where `solid` <= x < 1. Period 1.
inline CellMesh slit_plate(float height, float solid, float floor_albedo, float plate_albedo) {
  CellMesh mesh = floor_of(1, 1, floor_albedo);
  add_quad(mesh, {0, 0, height}, {solid, 0, height}, {solid, 1, height}, {0, 1, height}, plate_albedo);
  return mesh;
}

}  // namespace selvedge::test
