// At which height the texels of a cell should lie. Where they lie decides which surface points one texel
// collects over the views, so how well one table of views can tell what it sees.
#pragma once

#include "converter/bake/bake.h"
#include "converter/light/ray_scene.h"

namespace selvedge {

/// Mean height of the yarn that is seen straight from above, over the lowest point, in the scene's unit.
double mean_height(const RayScene& scene);

/// Of the heights 0.5, 0.6 ... 1.0 of the thickness, mm, the one whose fabric (fitted with default options at
/// level 0, from at most 16 x 16 texels, 36 views and 36 lights) comes nearest to 48 random pairs of
/// directions of their own. The options' own plane does not matter.
Result<double> best_reference_height(const CellMesh& mesh, const std::string& name,
                                     const BakeOptions& options);

}  // namespace selvedge
