// Heights of the slabs of a cell: the intervals of height that hold yarn (docs/bake.md, "Heights").
#pragma once

#include "converter/light/ray_scene.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// Heights for width x height texels of `shape`, in units of the scene above its lowest point. Slab 0 is the
/// uppermost yarn of a column, slab 1 the next below. A column's heights are means over 3 x 3 vertical lines;
/// a slab that fewer than half of them meet is absent. Yarns that intersect count as one. A surface that a
/// line enters but never leaves (a sheet) counts as 1/50 of the cell's height thick.
HeightLayer cell_heights(const RayScene& scene, int width, int height, const SlabShape& shape);

}  // namespace selvedge
