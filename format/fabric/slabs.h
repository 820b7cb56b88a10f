// Slabs: columns of yarn over the texels of a fabric, and the ray from the viewer that is marched through
// them (spec/brdf.md, "Heights").
//
// Cells of a level repeat like its texels: cell (i, j) of W x H, with W = w columns and H = h rows of the
// level, belongs to texel (i / columns, j / rows). Heights are mm above the cloth's lowest point.
#pragma once

#include <optional>

#include "format/fabric/fabric.h"

namespace selvedge {

/// What a ray met: a texel and one of its entries (SlabShape).
struct SlabHit {
  std::size_t texel = 0;
  std::size_t entry = 0;
};

/// Cells that a ray visits at most; beyond them it meets nothing.
inline constexpr int max_cells_of_a_ray = 16384;

/// Marches rays through the slabs of one level. Holds a reference: the level must outlive it.
class SlabMarch {
 public:
  /// `info`: that of the level's fabric. Precondition: the level has heights.
  SlabMarch(const FabricLevel& level, const FabricInfo& info);

  /// The yarn that the ray towards `view` (unit) meets first which passes the reference plane at (u, v).
  std::optional<SlabHit> operator()(const V2d& uv, const V3f& view) const;

  /// How many cells such a ray visits at most: what it costs.
  double max_cells(const V3f& view) const;

 private:
  /// Cells per mm upwards, along x and along y.
  V2d cells_per_mm(const V3f& view) const;
  V2i cells() const;

  const FabricLevel& level_;
  V2d period_;
  double plane_;
};

}  // namespace selvedge
