// The fabric: a small repeating array of texels with their reflectance, and its mip levels.
// Daubert et al. 2001, section 3; spec/brdf.md and spec/fabric.md say the same for other implementers.
//
// Frame of the fabric: x along growing u, y up in the picture (along falling v: v grows downwards as in
// glTF), z out of the cloth towards the viewer; right-handed. Texel (i, j) of a level of w x h texels
// covers u in [i/w, (i+1)/w) and v in [j/h, (j+1)/h); texel index = j * w + i. One repeat is one unit of
// u and v and period_mm millimetres of cloth.
//
// Reflectance of a texel, for unit light l and view v in the fabric's frame, pointing away from the cloth:
//   f(l, v) = T(v) * g(l', v')   in 1/sr, the light's cosine included (see lafortune.h),
// with l', v' in the texel's frame (tangent, normal x tangent, normal). Opacity alpha(v) says which part of
// the texel is yarn and not a hole; neither f nor T is multiplied by it. An absent layer counts as 1
// (frame: as the fabric's own frame).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "format/directions.h"
#include "format/error.h"
#include "format/lafortune.h"
#include "format/vec.h"

namespace selvedge {

/// Diffuse term and Lafortune lobes. parameters[(texel * 3 + channel) * parameter_count(lobes) + k],
/// k as in lafortune.h: rho, then Cx, Cy, Cz, n per lobe. rho >= 0, n >= 0.
struct LobeLayer {
  int lobes = 0;
  std::vector<float> parameters;
};

/// The texel's own frame, in the fabric's frame. Unit and perpendicular; the binormal is normal x tangent.
struct FrameLayer {
  std::vector<V3f> normal;
  std::vector<V3f> tangent;
};

/// T(v): colour[texel * views + view], a factor on g, mean about 1 per texel and channel, >= 0.
struct ViewTableLayer {
  std::vector<V3f> colour;
};

/// alpha(v): opacity[texel * views + view] in [0, 1].
struct OpacityLayer {
  std::vector<float> opacity;
};

struct FabricLevel {
  int width = 0;
  int height = 0;
  std::optional<LobeLayer> lobes;
  std::optional<FrameLayer> frame;
  std::optional<ViewTableLayer> view_table;
  std::optional<OpacityLayer> opacity;

  int texels() const { return width * height; }
};

struct Fabric {
  V2f period_mm{1, 1};         ///< size of one repeat along u and v
  float reference_height = 0;  ///< mm; height of the texels' plane above the cell's lowest point
  float thickness_mm = 0;      ///< mm; height of the cell's bounding box
  DirectionGrid views;         ///< layout of the view table and of opacity
  std::string provenance;      ///< JSON object: options, seed, software; "{}" where nothing is known
  std::vector<FabricLevel>
      levels;  ///< level k is max(1, w >> k) x max(1, h >> k); the last is 1 x 1 if complete
};

/// Stated limits of a fabric; beyond them a file is refused before anything is allocated.
struct FabricLimits {
  int texels_per_side = 4096;
  int directions = 4096;
  int lobes = 16;
};

/// Size of a mip level that is `level` steps above one of `size` texels (rounded down, at least 1).
constexpr int level_size(int size, int level) { return (size >> level) > 1 ? (size >> level) : 1; }

/// Number of levels down to 1 x 1.
int level_count(int width, int height);

/// The texel's tangent from its normal (paper section 4, restated): the x axis made perpendicular to
/// `normal`; the y axis takes x's place where the normal lies along x.
V3f tangent_of(const V3f& normal);

/// Array sizes, ranges and finiteness of everything in the fabric. Place: "level 1/lobes", or that of a
/// value, "table/level 2/table.0003.red/5,7".
Result<void> validate(const Fabric& fabric, const FabricLimits& limits = {});

}  // namespace selvedge
