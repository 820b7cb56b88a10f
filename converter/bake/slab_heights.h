// Where the yarn of a cell begins and ends over every point of the plane: the slabs of a fabric
// (docs/bake.md, "Heights").
#pragma once

#include "converter/light/ray_scene.h"
#include "format/fabric/fabric.h"

namespace selvedge {

/// Heights over width x height texels divided as `shape` says, in the scene's unit above its lowest point.
/// Slab 0 is the uppermost yarn of the column, slab 1 the next below. A cell's numbers are means over 3 x 3
/// vertical lines; a slab that fewer than half of these meet is not there. Yarns that pass through each other
/// count as one. A surface that is entered and never left (a sheet) is 1/50 of the cell's height thick.
HeightLayer cell_heights(const RayScene& scene, int width, int height, const SlabShape& shape);

}  // namespace selvedge
