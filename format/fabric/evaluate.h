// The reference evaluation of a fabric: plain and scalar. Every faster one is tested against it.
#pragma once

#include "format/fabric/fabric.h"
#include "format/fabric/shading.h"

namespace selvedge {

/// f(l, v) and alpha(v) of one texel. `light` and `view` are unit vectors in the fabric's frame. With
/// heights: the mean over one ray through the centre of every cell (slabs.h), alpha being the plain mean.
/// Radiance is 0 for light.z <= 0 and for view.z <= 0 (neither was ever seen by the fit). T(v) and alpha(v)
/// are interpolated between the four nearest stored views; T's weights are multiplied by the views'
/// alpha, so that a hole's meaningless colour counts for nothing.
/// Precondition: `level` exists and (x, y) lies within it.
Shading evaluate(const Fabric& fabric, int level, int x, int y, const V3f& light, const V3f& view);

/// The same of a level by itself; `info` is that of the fabric it belongs to.
Shading evaluate(const FabricLevel& level, const FabricInfo& info, int x, int y, const V3f& light,
                 const V3f& view);

/// A fractional level as the two it lies between: the lower, and the weight of the next, 0 where there is
/// none. Levels are clamped to the `count` that exist, NaN to 0.
struct LevelBlend {
  int lower = 0;
  float weight = 0;
};
LevelBlend level_blend(double level, int count);

/// The same at texture coordinates: the texel that contains (u, v) (repeating), and for a fractional level
/// the alpha-weighted blend of its two neighbours. Levels are clamped to those that exist.
Shading evaluate(const Fabric& fabric, double level, const V2d& uv, const V3f& light, const V3f& view);

/// Index of the texel of a row of `size` texels which contains coordinate `c` (repeating; c finite).
int wrap_texel(double c, int size);

/// Alpha-weighted mean of two shadings: alpha is the plain mean, radiance weighted by alpha.
Shading blend(const Shading& a, const Shading& b, float weight_of_b);

/// Whether the fabric has holes that can be seen, by which alphaMode and the fallback go: more than 0.05 % of
/// the level is open, seen from straight above. Opacity is a mean over the area, so that all levels without
/// slabs have the same answer, and a partial fabric that of the whole, but for noise and the steps of half
/// precision; where these decide it is about 0.05 % of what shows through. Slabs of coarser levels are fitted
/// by themselves and open by some percent more or less. Precondition: a valid fabric (see validate) that has
/// the level.
bool has_holes(const Fabric& fabric, int level);

}  // namespace selvedge
