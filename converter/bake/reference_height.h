// Finds the height at which the texels of a cell should lie. It decides which surface points one texel
// collects over the views, and so how well one view table can describe them.
#pragma once

#include "converter/bake/bake.h"
#include "converter/light/ray_scene.h"

namespace selvedge {

/// Mean height above the lowest point of the yarn seen from straight above, in units of the scene.
double mean_height(const RayScene& scene);

/// The best height in mm out of 0.5, 0.6 ... 1.0 of the thickness: the one whose fabric (fitted with default
/// options at level 0, from at most 16 x 16 texels, 36 views and 36 lights) has the smallest error on 48
/// random pairs of its own. options.reference is ignored.
Result<double> best_reference_height(const CellMesh& mesh, const std::string& name,
                                     const BakeOptions& options);

}  // namespace selvedge
