// Ray marching through slabs, the columns of yarn over the texels of a fabric (spec/brdf.md, "Heights").
//
// Cells of a level repeat like its texels: cell (i, j) of W x H, with W = w columns and H = h rows of the
// level, belongs to texel (i / columns, j / rows). Heights are mm above the cloth's lowest point.
#pragma once

#include <optional>

#include "format/fabric/fabric.h"

namespace selvedge {

/// The texel and the entry (SlabShape) that a ray hits.
struct SlabHit {
  std::size_t texel = 0;
  std::size_t entry = 0;
};

/// Maximum number of cells that a ray visits; a ray that needs more hits nothing.
inline constexpr int max_cells_per_ray = 16384;

/// Marches rays through the slabs of one level, which must outlive it.
class SlabMarch {
 public:
  /// `info`: of the level's fabric. Precondition: the level has heights.
  SlabMarch(const FabricLevel& level, const FabricInfo& info);

  /// The first yarn on the ray from the viewer (unit direction `view`) through (u, v) on the reference plane.
  std::optional<SlabHit> operator()(const V2d& uv, const V3f& view) const;

  /// Maximum number of cells that a ray along `view` visits, as a measure of its cost.
  double max_cells(const V3f& view) const;

 private:
  /// Cells that a ray crosses per mm of height, along x and along y.
  V2d cells_per_mm(const V3f& view) const;
  V2i cells() const;

  const FabricLevel& level_;
  V2d period_;
  double plane_;
};

}  // namespace selvedge
