// A fabric laid out for the evaluation of many pixels at once: everything in groups of four numbers, which
// are fetched for several pixels and turned into vectors. Prepared once.
#pragma once

#include <array>
#include <vector>

#include "format/fabric/fabric.h"

namespace selvedge {

/// Which numbers a level has. Texels of levels with equal layouts can be evaluated together.
struct PackedLayout {
  bool has_lobes = false;   ///< else g = 1
  int lobes = 0;            ///< beside the diffuse term
  bool has_views = false;   ///< T or alpha; else both are 1
  bool has_table = false;   ///< T or S: the bracket has a first term
  bool has_lights = false;  ///< S; else 1
  bool has_heights = false;
  int entries = 1;  ///< of a texel's products
  int products = 0;
  std::vector<V2i> pairs;  ///< of the products
  bool operator==(const PackedLayout&) const = default;
  /// Groups of a texel: normal and rho of red, tangent and rho of green, rho of blue and nothing; then
  /// (Cx, Cy, Cz, n) for [channel][lobe].
  int texel_groups() const { return 3 + 3 * lobes; }
  /// Groups of an entry: its coefficients, the last group filled up with 0.
  int entry_groups() const { return (products + 3) / 4; }
};

using Group = std::array<float, 4>;

struct PackedLevel {
  int width = 0;
  int height = 0;
  int layout = 0;              ///< index into PackedFabric::layouts
  std::vector<Group> texels;   ///< [texel][texel_groups]
  std::vector<Group> views;    ///< [texel][view]: alpha T, alpha
  std::vector<Group> lights;   ///< [texel][light]: S, 0
  std::vector<Group> entries;  ///< [texel][entry][entry_groups]
};

struct PackedFabric {
  const Fabric* fabric = nullptr;  ///< where it comes from; rays through slabs are marched there
  std::vector<PackedLevel> levels;
  std::vector<PackedLayout> layouts;
  int view_functions = 0;          ///< phi_a, a > 0
  int light_functions = 0;         ///< psi_b
  std::vector<float> view_basis;   ///< [view][a - 1]
  std::vector<Group> light_basis;  ///< [light][b]: psi_b, 0
  bool needs_views = false;        ///< some level looks views up
  bool needs_lights = false;
};

/// `fabric` must outlive what is made of it, and have passed validate().
PackedFabric pack(const Fabric& fabric);

}  // namespace selvedge
