// Fabrics of the module.
#include <algorithm>
#include <cmath>
#include <optional>

#include "format/fabric/evaluate.h"
#include "format/fabric/level_values.h"
#include "viewer/web/cells/page.h"

using namespace selvedge;
using namespace selvedge::web;

namespace {

struct FabricInput {
  std::int32_t width, height, levels;
  V2f period;  ///< mm
  float reference_height, thickness;
};

struct SideInput {
  std::int32_t side;
  DirectionGrid views, lights;
  std::int32_t lobes, products, view_functions, light_functions;
  YarnCounts yarns;
  float radiance_scale;
};

/// Variation::row_brightness and Variation::row_offsets, along u and v each.
struct VariationNumbers {
  std::array<std::uint32_t, 6> keys;                ///< of the lattices
  std::array<std::array<std::int32_t, 3>, 4> runs;  ///< rows, lengths, 2^log2_repeats
  std::array<V3f, 4> changes;                       ///< offset, change, and lengths of a repeat
  V2f fraction_along_v;                             ///< of yarn seen from in front and from behind
  V2f relief;                                       ///< repeats along u and v of a step of CellImage::heights
};

}  // namespace

/// Begins a fabric; input: FabricInput. Returns its number.
EXPORT(add_fabric) std::uint32_t add_fabric() {
  const auto& in = *input_as<FabricInput>();
  Fabric& fabric = page.fabrics.emplace_back(std::make_shared<LoadedFabric>())->fabric;
  fabric.period_mm = in.period;
  fabric.reference_height = in.reference_height;
  fabric.thickness_mm = in.thickness;
  for (int k = 0; k < in.levels; ++k) {
    FabricLevel& level = fabric.levels.emplace_back();
    level.width = level_size(in.width, k);
    level.height = level_size(in.height, k);
  }
  return static_cast<std::uint32_t>(page.fabrics.size() - 1);
}

/// Begins a side of a fabric; input: SideInput.
EXPORT(add_side) void add_side(std::uint32_t number) {
  LoadedFabric& loaded = *page.fabrics[number];
  const auto& in = *input_as<SideInput>();
  const LayerShape shape{static_cast<Side>(in.side),
                         in.lobes,
                         std::max(in.views.count(), 1),
                         std::max(in.lights.count(), 1),
                         in.products,
                         in.view_functions,
                         in.light_functions,
                         in.yarns,
                         loaded.fabric.levels.front().texels()};
  Fabric* side = &loaded.fabric;
  if (shape.side == Side::front) {
    loaded.shape = shape;
  } else {
    side = &loaded.pending_sides.emplace_back(shape, loaded.fabric).second;
    for (FabricLevel& level : side->levels) {
      FabricLevel fresh;
      fresh.width = level.width;
      fresh.height = level.height;
      level = fresh;
    }
    side->sides = {};
  }
  side->side = shape.side;
  side->views = in.views;
  side->lights = in.lights;
  side->radiance_scale = in.radiance_scale;
}

/// Sets a layer of the side that was begun last; input: pairs of products (whole, two each), then its
/// channels of all texels.
EXPORT(add_layer)
void add_layer(std::uint32_t number, std::uint32_t kind, std::uint32_t k, std::uint32_t channels,
               std::uint32_t pairs) {
  LoadedFabric& loaded = *page.fabrics[number];
  const LayerShape& shape = loaded.pending_sides.empty() ? loaded.shape : loaded.pending_sides.back().first;
  FabricLevel& level =
      (loaded.pending_sides.empty() ? loaded.fabric : loaded.pending_sides.back().second).levels[k];
  const auto* whole = input_as<std::int32_t>();
  for (std::uint32_t i = 0; i < pairs; ++i) level.pairs.emplace_back(whole[2 * i], whole[2 * i + 1]);
  const auto texels = static_cast<std::size_t>(level.texels());
  std::vector<std::vector<float>> planes;
  const float* from = input_as<float>() + 2 * std::size_t{pairs};
  for (std::uint32_t i = 0; i < channels; ++i, from += texels) planes.emplace_back(from, from + texels);
  std::vector<const std::vector<float>*> pointers;
  for (const std::vector<float>& plane : planes) pointers.push_back(&plane);
  set_layer_pixels(level, static_cast<LayerKind>(kind), shape, pointers);
}

/// Ends a fabric; `shown` of other sides: input, [side][level], the level whose texels a level shows. Returns
/// 0 where it is refused, 2 with holes, else 1.
EXPORT(end_fabric) std::uint32_t end_fabric(std::uint32_t number) {
  LoadedFabric& loaded = *page.fabrics[number];
  Fabric& fabric = loaded.fabric;
  const auto share_bases = [](Fabric& side) {
    const std::shared_ptr<const ProductBases> bases = side.levels.front().bases;
    for (FabricLevel& level : side.levels) level.bases = level.has(LayerKind::products) ? bases : nullptr;
  };
  share_bases(fabric);
  IssueSink sink("");
  if (loaded.shape.yarns.curves > 0)
    restore_yarns(fabric.levels.front(), loaded.shape, fabric.period_mm, default_memory_limit, sink);
  if (sink.has_error()) return 0;
  const auto* shown = input_as<std::int32_t>();
  for (auto& [shape, side] : loaded.pending_sides) {
    share_bases(side);
    restore_light_through(fabric.levels.front(), side.levels.front());
    const int levels = static_cast<int>(side.levels.size());
    for (int k = 0; k < levels; ++k, ++shown)
      if (*shown > k) side.levels[k].copy_texels(side.levels[*shown], *shown - k);
    fabric.add_side(std::move(side));
  }
  loaded.pending_sides.clear();
  loaded.sides.emplace(fabric);
  return has_holes(fabric, static_cast<int>(fabric.levels.size()) - 1) ? 2 : 1;
}

EXPORT(variation_of) const VariationNumbers* variation_of(std::uint32_t number) {
  static VariationNumbers result;
  const FabricSides& sides = *page.fabrics[number]->sides;
  const auto& yarns = sides.front->levels.front().yarns();
  const Variation variation = yarns ? yarns->variation() : Variation{};
  const auto& behind = sides.seen_from(true).levels.front().yarns();
  for (std::uint32_t i = 0; i < result.keys.size(); ++i) result.keys[i] = variation_key(variation.seed, i);
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    const RowNoise& runs = (i < 2 ? variation.row_brightness : variation.row_offsets)[i % 2];
    result.runs[i] = {runs.rows, runs.lengths, 1 << runs.log2_repeats};
    result.changes[i] = {runs.offset, runs.amplitude,
                         std::ldexp(static_cast<float>(runs.lengths), -runs.log2_repeats)};
  }
  if (yarns) result.relief = V2f(height_step(*yarns, sides.front->reference_height)) / yarns->tile();
  result.fraction_along_v = {variation.along_v_fraction, behind ? behind->variation().along_v_fraction : 0};
  return &result;
}

/// f and alpha, of a texel or at texture coordinates (evaluate.h). Input: light and view.
EXPORT(evaluate_query)
const V4f* evaluate_query(std::uint32_t number, std::uint32_t behind, std::uint32_t of_texel, double level,
                          double x, double y) {
  static V4f result;
  const LoadedFabric& loaded = *page.fabrics[number];
  Fabric all_texels;  // of a map
  std::optional<FabricSides> sides;
  if (loaded.shape.yarns.map_size.x > 0) {
    all_texels = arranged(loaded.fabric);
    sides.emplace(all_texels);
  }
  const Fabric& seen = (sides ? sides : loaded.sides)->seen_from(behind != 0);
  const V3f& light = input_as<V3f>()[0];
  const V3f& view = input_as<V3f>()[1];
  const Shading shading = of_texel != 0 ? evaluate(seen, static_cast<int>(level), static_cast<int>(x),
                                                   static_cast<int>(y), light, view)
                                        : evaluate(seen, level, V2d(x, y), light, view);
  result = V4f(shading.radiance.x, shading.radiance.y, shading.radiance.z, shading.alpha);
  return &result;
}
