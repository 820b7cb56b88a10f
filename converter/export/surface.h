// A dressed surface as a map from the fabric's texture coordinates into space.
#pragma once

#include <Imath/ImathBox.h>

#include <array>
#include <optional>
#include <vector>

#include "format/scene/scene.h"

namespace selvedge {

/// Cloth on triangles of the scene; all that wears one material. Texture coordinates count repeats, or
/// stitches of a map.
struct Cloth {
  struct Corner {
    V2d uv;
    V3d position, normal;  ///< m, world; unit, to the front
  };
  struct Triangle {
    std::array<Corner, 3> corners;
    int patch_index = 0;       ///< the same for triangles that hang together
    bool is_mirrored = false;  ///< whether the fabric shows as in a mirror; of all in a patch
  };
  std::vector<Triangle> triangles;  ///< without those whose texture coordinates cover no area
  double area = 0;                  ///< m^2
  double uv_area = 0;               ///< area of the texture coordinates

  /// Takes a triangle with its area; corners with equal positions and texture coordinates join.
  void add_triangle(const std::array<Corner, 3>& corners);
  /// Sets the patches of all triangles.
  void assign_patches();
};

/// Precondition: the scene has the material, with a fabric of a set that is read.
/// Texture coordinates count `cells` of a repeat.
Cloth cloth_of(const Scene& scene, int material, const V2d& cells = {1, 1});

/// The fabric's texture coordinates from (u, v) to (u + 1, v + 1) on a patch, and the triangles of it that
/// yarn of the repeat may lie on.
struct ClothCell {
  int patch = 0;
  V2i repeat_index{0, 0};
  std::vector<int> triangles;
  int stitch = 0;  ///< of a map
};

/// The cells whose yarn may lie on the cloth, patch by patch and row by row. `reach`: of a repeat
/// (yarn_uv_bounds()). Nothing if there are more than `limit`, or texture coordinates beyond
/// max_repeat_index.
std::optional<std::vector<ClothCell>> cells_of(const Cloth& cloth, const Imath::Box2d& reach, double limit);

/// A point of a surface: where it is, and how it changes with the texture coordinates.
struct ClothPoint {
  V3d position{0, 0, 0};               ///< m
  V3d dp_du{0, 0, 0}, dp_dv{0, 0, 0};  ///< m a repeat
  V3d normal{0, 0, 0};                 ///< unit
  bool is_inside = false;  ///< whether the surface has the texture coordinates; else a neighbour is continued
};

/// The surface curves between the corners as their normals turn (Boubekeur and Alexa 2008, "Phong
/// Tessellation"). Precondition: the cell has triangles.
ClothPoint point_at(const Cloth& cloth, const ClothCell& cell, const V2d& uv);

}  // namespace selvedge
