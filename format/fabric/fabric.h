// The fabric: a small repeating array of texels with their reflectance, and its mip levels.
// Daubert et al. 2001, section 3; spec/brdf.md and spec/fabric.md say the same for other implementers.
//
// Frame of the fabric: x along growing u, y up in the picture (along falling v: v grows downwards as in
// glTF), z out of the cloth towards the viewer; right-handed. Texel (i, j) of a level of w x h texels
// covers u in [i/w, (i+1)/w) and v in [j/h, (j+1)/h); texel index = j * w + i. One repeat is one unit of
// u and v and period_mm millimetres of cloth.
//
// Reflectance of a texel, for unit light l and view v in the fabric's frame, pointing away from the cloth:
//   f(l, v) = g(l', v') * max(0, T(v) S(l) + sum_m c_m phi_a(m)(v) psi_b(m)(l))   in 1/sr,
// with l', v' in the texel's frame (tangent, normal x tangent, normal). g includes the light's cosine (see
// lafortune.h); without lobes it is 1. Without products the bracket is T S, the paper's model being T alone;
// with products and neither table it is their sum. Opacity alpha(v) says which part of the texel is yarn and
// not a hole; neither f nor T is multiplied by it. An absent layer counts as 1 (frame: as the fabric's own
// frame).
//
// With heights a texel owns columns of the cloth instead of a place on the reference plane: the ray from the
// viewer is marched to the yarn that it meets (slabs.h), and what it meets decides whose products count.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/base/mip.h"
#include "format/base/vec.h"
#include "format/fabric/directions.h"
#include "format/fabric/lafortune.h"

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

/// S(l): value[texel * lights + light], a factor beside T, >= 0.
struct LightTableLayer {
  std::vector<V3f> value;
};

/// How the columns of a texel are divided: cells side by side, `slabs` of yarn one above the other in each.
struct SlabShape {
  int columns = 1;
  int rows = 1;
  int slabs = 1;
  /// Entry (slab * rows + row) * columns + column of a texel; row 0 is the texel's top row.
  int entries() const { return columns * rows * slabs; }
  bool operator==(const SlabShape&) const = default;
};

/// Where the yarn of every entry begins and ends: [texel * entries + entry], mm above the cloth's lowest
/// point. An entry with top <= bottom has no yarn.
class HeightLayer {
 public:
  /// Precondition: `top` and `bottom` have the same length, that of all texels' entries.
  HeightLayer(const SlabShape& shape, std::vector<float> top, std::vector<float> bottom);
  const SlabShape& shape() const { return shape_; }
  const std::vector<float>& top() const { return top_; }
  const std::vector<float>& bottom() const { return bottom_; }
  /// Over the entries with yarn; lowest > highest where there are none.
  float highest() const { return highest_; }
  float lowest() const { return lowest_; }

 private:
  SlabShape shape_;
  std::vector<float> top_;
  std::vector<float> bottom_;
  float highest_;
  float lowest_;
};

/// Functions of direction that all texels share. phi_0 = 1 and phi_a, a > 0, are numbers over the grid of
/// views; psi_b are colours over the grid of lights. May be negative.
struct ProductBases {
  std::vector<float> view;  ///< phi_a: [(a - 1) * views + view]
  std::vector<V3f> light;   ///< psi_b: [b * lights + light]
};

/// c: coefficient[(texel * entries + entry) * pairs.size() + m], one entry unless the level has heights.
struct ProductLayer {
  int entries = 1;
  std::vector<V2i> pairs;  ///< (a, b) of product m
  std::vector<float> coefficient;
};

struct FabricLevel {
  int width = 0;
  int height = 0;
  std::optional<LobeLayer> lobes;
  std::optional<FrameLayer> frame;
  std::optional<ViewTableLayer> view_table;
  std::optional<OpacityLayer> opacity;
  std::optional<LightTableLayer> light_table;
  std::optional<HeightLayer> heights;
  std::optional<ProductLayer> products;
  std::shared_ptr<const ProductBases> bases;  ///< where there are products; the same in all levels

  int texels() const { return width * height; }
};

/// What a partial fabric is a part of: its level 0 is level `level` of a fabric whose own level 0 has
/// `texels`. Levels are missing before it, behind the part's last, or both.
struct WholeFabric {
  V2i texels{1, 1};
  int level = 1;   ///< >= 0
  int levels = 0;  ///< of the whole; 0: not known, as far as the part's last at least
  bool operator==(const WholeFabric&) const = default;
};

struct Fabric {
  V2f period_mm{1, 1};         ///< size of one repeat along u and v
  float reference_height = 0;  ///< mm; height of the texels' plane above the cell's lowest point
  float thickness_mm = 0;      ///< mm; height of the cell's bounding box
  DirectionGrid views;         ///< layout of the view table, of opacity and of phi
  DirectionGrid lights;        ///< layout of the light table and of psi; without them of no meaning
  float radiance_scale = 1;  ///< factor on f of all texels, > 0: keeps the layers' numbers in half precision
  std::string provenance;    ///< JSON object: options, seed, software; "{}" where nothing is known
  std::optional<WholeFabric> whole;  ///< of a partial fabric
  std::vector<FabricLevel>
      levels;  ///< level k is max(1, w >> k) x max(1, h >> k); the last is 1 x 1 if complete
};

/// Stated limits of a fabric; beyond them a file is refused before anything is allocated.
struct FabricLimits {
  int texels_per_side = 4096;
  int directions = 4096;
  int lobes = 16;
  int cells_per_side = 16;  ///< of a texel
  int slabs = 8;
  int functions = 256;  ///< of each basis
  int products = 256;
};

/// Texels of level 0 of the whole fabric, and which of its levels is the fabric's level 0. Precondition: the
/// fabric has a level.
V2i whole_texels(const Fabric& fabric);
int first_level(const Fabric& fabric);

/// Whether a level 0 of `width` x `height` texels can be that level of the whole.
bool is_level_of(const WholeFabric& whole, int width, int height);

/// Whether a fabric of `levels` levels can be a part of it, with a level less at least. Precondition:
/// is_level_of() its level 0.
bool is_more_than(const WholeFabric& whole, int levels);

/// The texel's tangent from its normal (paper section 4, restated): the x axis made perpendicular to
/// `normal`; the y axis takes x's place where the normal lies along x.
V3f tangent_of(const V3f& normal);

/// Array sizes, ranges and finiteness of everything in the fabric. Place: "level 1/lobes", or that of a
/// value, "table/level 2/table.0003.red/5,7".
Result<void> validate(const Fabric& fabric, const FabricLimits& limits = {});

}  // namespace selvedge
