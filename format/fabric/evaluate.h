// The reference evaluation of a fabric, in scalar code. Faster evaluations are tested against it.
#pragma once

#include "format/fabric/fabric.h"
#include "format/fabric/shading.h"

namespace selvedge {

/// f(l, v) and alpha(v) of one texel. `light` and `view` are unit vectors in the fabric's frame.
/// Where light.z < 0, the side `through` answers; the radiance is 0 without it, for light.z = 0, and for
/// view.z <= 0: from behind, evaluate turned_over(fabric). T(v) and alpha(v) are
/// interpolated between the four nearest stored views; T's weights are multiplied by the views' alpha,
/// because the colour of a hole has no meaning. Precondition: `level` exists and (x, y) lies within it.
Shading evaluate(const Fabric& fabric, int level, int x, int y, const V3f& light, const V3f& view);

/// As above for a level of one side; `info`: of its fabric, and the radiance is 0 for light.z <= 0.
Shading evaluate(const FabricLevel& level, const FabricInfo& info, int x, int y, const V3f& light,
                 const V3f& view);

/// T(v) and alpha(v) of one texel.
struct ViewFactors {
  V3f colour{1, 1, 1};
  float alpha = 1;
};
ViewFactors view_factors(const FabricLevel& level, const DirectionTaps& views, int texel);

/// Functions a of the view, 1 for a = 0, and b of the light that products have, at a direction.
float phi(const ProductBases& bases, const FabricInfo& info, int a, const DirectionTaps& views);
V3f psi(const ProductBases& bases, const FabricInfo& info, int b, const DirectionTaps& lights);

/// A direction and its cells: many texels share them.
struct TappedDirection {
  TappedDirection(const DirectionGrid& grid, const V3f& towards)
      : direction(towards), taps(interpolate(grid, towards)) {}
  V3f direction;
  DirectionTaps taps;
};
/// f(l, v) of a texel whose view_factors() are known; 0 where light or view is not above the cloth.
V3f radiance_of(const FabricLevel& level, const FabricInfo& info, int texel, const ViewFactors& factors,
                const TappedDirection& light, const TappedDirection& view);

/// The bracket F(l, v) of the formula for each stored light; for a texel where it does not depend on the
/// light, one value.
std::vector<V3f> light_factors(const FabricLevel& level, const FabricInfo& info, int texel, const V3f& view);

/// A fractional level as the integer level below it and the weight of the next one. Levels are clamped to
/// `first` ... count - 1, NaN to `first`.
struct LevelBlend {
  int finer_level = 0;
  float weight = 0;
};
LevelBlend level_blend(double level, int count, int first = 0);

/// Evaluates the texel at texture coordinates (u, v), which repeat. A fractional level is the alpha-weighted
/// blend of the two levels next to it; levels are clamped to the fabric's.
/// Level -1 is the yarn itself at (u, v), if the fabric has it. Yarn varies beyond the repeat (variation.h).
Shading evaluate(const Fabric& fabric, double level, const V2d& uv, const V3f& light, const V3f& view);

/// Index of the texel that contains coordinate `c` (finite, repeating) in a row of `size` texels.
int wrap_texel(double c, int size);

/// Weighted mean of two shadings; radiance is also weighted by alpha.
Shading blend(const Shading& a, const Shading& b, float weight_of_b);

/// Whether the fabric has visible holes, on which alphaMode and the fallback depend: more than 0.05 % of the
/// level is open, seen from straight above. Opacity is a mean over the area, so that levels
/// agree up to noise and the rounding of half precision.
/// Precondition: a valid fabric (see validate) that has the level.
bool has_holes(const Fabric& fabric, int level);

}  // namespace selvedge
