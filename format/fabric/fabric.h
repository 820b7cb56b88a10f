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
// lafortune.h); without lobes it is the cosine alone. Without products the bracket is T S (the paper's
// model is T alone); with products and neither table it is their sum. Opacity alpha(v) is the fraction of the
// texel that is yarn and not a hole; neither f nor T is multiplied by it. An absent layer counts as 1, an
// absent frame as the fabric's frame.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/base/memory.h"
#include "format/base/mip.h"
#include "format/base/vec.h"
#include "format/fabric/directions.h"
#include "format/fabric/lafortune.h"
#include "format/fabric/layers.h"
#include "format/fabric/yarns.h"

namespace selvedge {

/// The texel's own frame, in the fabric's frame. Unit and perpendicular; the binormal is normal x tangent.
struct TexelFrame {
  V3f normal;
  V3f tangent;
};

/// Functions of direction that all texels share: phi_a over the grid of views, with phi_0 = 1, which is not
/// stored; colours psi_b over the grid of lights. May be negative.
struct ProductBases {
  std::vector<float> view;  ///< phi_a: [(a - 1) * views + view]
  std::vector<V3f> light;   ///< psi_b: [b * lights + light]
};

/// A mip level: its layers, and typed views of them. The view of an absent layer is empty. A view is valid
/// until its layer is set or removed.
struct FabricLevel {
  int width = 0;
  int height = 0;
  bool copied_from_coarser = false;           ///< texels copied from the next level: copy_texels()
  std::vector<V2i> pairs;                     ///< (a, b) of product m
  std::shared_ptr<const ProductBases> bases;  ///< of a level with products; the same in all levels

  int texels() const { return width * height; }
  bool has(LayerKind kind) const {
    return kind == LayerKind::bases ? bases != nullptr : (*this)[kind].channels > 0;
  }
  /// The layer of the bases is always empty.
  const Layer& operator[](LayerKind kind) const { return layers_[index_of(kind)]; }
  void set_layer(LayerKind kind, Layer layer) { layers_[index_of(kind)] = std::move(layer); }
  /// Sets a layer of equal values.
  void add_layer(LayerKind kind, int channels, float value = 0) {
    set_layer(kind, {channels, std::vector<float>(std::size_t{1} * texels() * channels, value)});
  }
  void remove_layer(LayerKind kind) { layers_[index_of(kind)] = {}; }
  /// Copies texel values from the level `steps` coarser; keeps the yarn.
  void copy_texels(const FabricLevel& coarser, int steps);
  /// Sets the layers of yarn and its indirect light. Null: removes them.
  void set_yarns(std::shared_ptr<const Yarns> yarns);

  /// Diffuse term and Lafortune lobes: [(texel * 3 + channel) * parameter_count(lobe_count()) + k], k as in
  /// lafortune.h: rho, then Cx, Cy, Cz, n per lobe. rho >= 0, n >= 0.
  std::span<const float> lobes() const { return values<float>(LayerKind::lobes); }
  std::span<float> lobes() { return values<float>(LayerKind::lobes); }
  int lobe_count() const { return ((*this)[LayerKind::lobes].channels / 3 - 1) / 4; }
  /// [texel]
  std::span<const TexelFrame> frame() const { return values<TexelFrame>(LayerKind::frame); }
  std::span<TexelFrame> frame() { return values<TexelFrame>(LayerKind::frame); }
  /// T(v): [texel * views + view], a factor on g, mean about 1 per texel and channel, >= 0.
  std::span<const V3f> view_table() const { return values<V3f>(LayerKind::table); }
  std::span<V3f> view_table() { return values<V3f>(LayerKind::table); }
  /// alpha(v): [texel * views + view] in [0, 1].
  std::span<const float> opacity() const { return values<float>(LayerKind::opacity); }
  std::span<float> opacity() { return values<float>(LayerKind::opacity); }
  /// S(l): [texel * lights + light], a factor beside T, >= 0.
  std::span<const V3f> light_table() const { return values<V3f>(LayerKind::light); }
  std::span<V3f> light_table() { return values<V3f>(LayerKind::light); }
  /// c: [texel * pairs.size() + m]
  std::span<const float> coefficients() const { return values<float>(LayerKind::products); }
  std::span<float> coefficients() { return values<float>(LayerKind::products); }
  /// Yarn of level 0; null without.
  const std::shared_ptr<const Yarns>& yarns() const { return yarns_; }

 private:
  // Imath's vectors are floats without padding.
  static constexpr std::size_t float_size = sizeof(float);
  template <class T>
  std::span<const T> values(LayerKind kind) const {
    const std::vector<float>& floats = (*this)[kind].values;
    return {reinterpret_cast<const T*>(floats.data()), floats.size() * float_size / sizeof(T)};
  }
  template <class T>
  std::span<T> values(LayerKind kind) {
    std::vector<float>& floats = layers_[index_of(kind)].values;
    return {reinterpret_cast<T*>(floats.data()), floats.size() * float_size / sizeof(T)};
  }

  std::array<Layer, all_layers.size()> layers_;
  std::shared_ptr<const Yarns> yarns_;
};

/// Properties that all levels of a fabric share.
struct FabricInfo {
  V2f period_mm{1, 1};  ///< size of one repeat along u and v
  /// mm; height of the reference plane above the lowest point of the cell, turned over for views from behind
  float reference_height = 0;
  float thickness_mm = 0;  ///< mm; height of the cell's bounding box
  DirectionGrid views;     ///< layout of the view table, of opacity and of phi
  DirectionGrid lights;    ///< layout of the light table and of psi; else unused
  Side side = Side::front;
  float radiance_scale = 1;  ///< factor on f of all texels, > 0: keeps the layers' numbers in half precision
  std::string provenance = "{}";  ///< JSON object: options, seed, software; "{}" if unknown
  std::string data_sheet = "{}";  ///< JSON object: the data sheet of the cloth; "{}" if unknown; of the front
  std::string fallback = "{}";    ///< JSON object: factors of glTF's core material; likewise
  std::string recipe = "{}";      ///< JSON object: stitch and options that `make` was given; likewise
  std::string accuracy = "{}";    ///< JSON object: errors against the stitch, dB; likewise
};

struct Fabric : FabricInfo {
  /// Level k has level_size() texels; the last is 1 x 1 unless coarser levels are missing.
  std::vector<FabricLevel> levels;
  /// The other sides of the cloth (by index_of(Side) - 1), each with the texels and levels of the front; null
  /// where the file has none. Directions are in the frame of the side that is seen, and lights that come
  /// through are mirrored into its upper half. The opacity of such a side is the visible side's.
  std::array<std::shared_ptr<const Fabric>, other_sides.size()> sides;

  /// Texels of level 0. Precondition: the fabric has a level.
  V2i texels() const { return {levels.front().width, levels.front().height}; }
  /// The map of its yarn; null without.
  const YarnMap* find_map() const {
    const auto& yarns = levels.front().yarns();
    return yarns && !yarns->data().map.empty() ? &yarns->data().map : nullptr;
  }
  /// Texels of a level over the whole repeat, also of a map, of which the level itself has the yarn's
  /// stitches.
  V2i repeat_texels(int level) const {
    const YarnMap* const map = find_map();
    if (map == nullptr) return {levels[level].width, levels[level].height};
    return {level_size(map->size.x, level), level_size(map->size.y, level)};
  }
  /// Null where the fabric does not have it. Not of the front.
  const Fabric* find_side(Side other) const { return sides[index_of(other) - 1].get(); }
  /// Adds another side of the same texels and levels, and gives light that comes through the opacity of the
  /// side that is seen, which is to be added first.
  void add_side(Fabric other);
};

/// Calls `visit` with the fabric and its other sides.
template <class Visit>
void for_each_side(const Fabric& fabric, const Visit& visit) {
  visit(fabric);
  for (const auto& other : fabric.sides)
    if (other) visit(*other);
}

/// The fabric with the texels of its map's repeat: one for each of its stitches, and coarser levels that are
/// means of those, by their opacity. For evaluation by (u, v); not to be written. Without a map, itself.
Fabric arranged(const Fabric& fabric);

/// Texels of a map, `size` of them, from the stitch at column and row `first` of any repeat on: each the mean
/// of 2^number x 2^number stitches, by their opacity.
FabricLevel shown_texels(const FabricLevel& level, const YarnMap& map, const V2i& first, const V2i& size,
                         int number = 0);

/// The fabric turned over, so that its back is its front: levels of the back, or of the front where it
/// has none, and the yarn from below. Precondition: it has a back.
Fabric turned_over(const Fabric& fabric);

/// Limits of a fabric; a file beyond them is refused before anything is allocated.
struct FabricLimits {
  int texels_per_side = 4096;
  int directions = 4096;
  int lobes = 16;
  int functions = 256;  ///< of each basis
  int products = 256;
  int curves = 1 << 16;  ///< of yarn
  int nodes = 1 << 20;
  int stations = 1 << 18;
  int values_per_curve = 64;     ///< of a curve of yarn
  int values_per_station = 256;  ///< of a station of its light
  /// Bytes that the levels which are read together may take, with what reading them takes.
  std::uint64_t memory = default_memory_limit;
};

/// The functions that all levels with products share; null without products.
std::shared_ptr<const ProductBases> shared_bases(const Fabric& fabric);

/// Preconditions: the fabric has a level, and its levels agree.
LayerShape layer_shape_of(const Fabric& fabric);

/// The texel's tangent from its normal (paper section 4, restated): the x axis made perpendicular to
/// `normal`, or the y axis if the normal lies along x.
V3f tangent_of(const V3f& normal);

}  // namespace selvedge
