#include "format/fabric/fabric.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "format/fabric/level_values.h"

namespace selvedge {
namespace {

/// Mean opacity of a texel over all views, above 0.
float weight_of_products(const FabricLevel& level, std::size_t texel) {
  const Layer& opacity = level[LayerKind::opacity];
  if (opacity.channels == 0) return 1;
  const auto first = opacity.values.begin() + static_cast<std::ptrdiff_t>(texel * opacity.channels);
  const float mean =
      std::reduce(first, first + opacity.channels, 0.0F) / static_cast<float>(opacity.channels);
  return std::max(mean, 1e-6F);
}

/// Texels in place of so many along both sides, each the mean of those that lie there, by their opacity:
/// `at`(column, row) of a level.
FabricLevel mean_texels(const FabricLevel& level, const V2i& size, const V2i& many, const auto& at) {
  FabricLevel result;
  result.width = size.x;
  result.height = size.y;
  result.pairs = level.pairs;
  result.bases = level.bases;
  std::vector<float> weights(level.texels(), 1);
  for (const LayerKind kind : {LayerKind::opacity, LayerKind::products}) {
    for (std::size_t i = 0; i < weights.size() && kind == LayerKind::products && many != size; ++i)
      weights[i] = weight_of_products(level, i);
    const Layer& from = level[kind];
    Layer layer{from.channels, std::vector<float>(std::size_t{1} * result.texels() * from.channels)};
    for (int texel = 0; texel < result.texels(); ++texel) {
      const V2i place(texel % size.x, texel / size.x);
      const V2i begin = place * many / size;
      const V2i end = (place + V2i(1)) * many / size;
      float* const to = &layer.values[std::size_t{1} * texel * layer.channels];
      float sum = 0;
      for (int y = begin.y; y < end.y; ++y)
        for (int x = begin.x; x < end.x; ++x) {
          const std::size_t part = at(x, y);
          const float weight = weights[part];
          const float* const values = &from.values[part * from.channels];
          for (int i = 0; i < layer.channels; ++i) to[i] += weight * values[i];
          sum += weight;
        }
      for (int i = 0; i < layer.channels; ++i) to[i] /= sum;
    }
    result.set_layer(kind, std::move(layer));
  }
  return result;
}

}  // namespace

void FabricLevel::copy_texels(const FabricLevel& coarser, int steps) {
  copied_from_coarser = true;
  pairs = coarser.pairs;
  bases = coarser.bases;
  for (const LayerKind kind : {LayerKind::lobes, LayerKind::frame, LayerKind::table, LayerKind::opacity,
                               LayerKind::light, LayerKind::products}) {
    const Layer& from = coarser[kind];
    Layer layer{from.channels, {}};
    layer.values.reserve(std::size_t{1} * texels() * layer.channels);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const int texel = std::min(y >> steps, coarser.height - 1) * coarser.width +
                          std::min(x >> steps, coarser.width - 1);
        const auto first = from.values.begin() + std::ptrdiff_t{texel} * from.channels;
        layer.values.insert(layer.values.end(), first, first + from.channels);
      }
    }
    set_layer(kind, std::move(layer));
  }
}

void FabricLevel::set_yarns(std::shared_ptr<const Yarns> yarns) {
  remove_layer(LayerKind::yarns);
  remove_layer(LayerKind::indirect);
  remove_layer(LayerKind::map);
  yarns_ = std::move(yarns);
  if (!yarns_) return;
  set_layer(LayerKind::yarns, layer_from_values(curve_values(yarns_->data()), texels()));
  set_layer(LayerKind::indirect, layer_from_values(indirect_values(yarns_->data()), texels()));
  const YarnMap& map = yarns_->data().map;
  if (map.empty()) return;
  std::vector<float> values(map.lines.begin(), map.lines.end());
  values.insert(values.end(), map.shown.begin(), map.shown.end());
  set_layer(LayerKind::map, layer_from_values(values, texels()));
}

void Fabric::add_side(Fabric other) {
  const Fabric* const seen = other.side == Side::back_through ? find_side(Side::back) : this;
  for (std::size_t k = 0; seen != nullptr && is_transmission(other.side) && k < other.levels.size(); ++k)
    other.levels[k].set_layer(LayerKind::opacity, seen->levels[k][LayerKind::opacity]);
  if (other.side == Side::through) {
    FabricLevel& base = other.levels.front();
    base.remove_layer(LayerKind::indirect);
    const auto& yarns = levels.front().yarns();
    if (yarns && !yarns->data().light_through.empty())
      base.set_layer(LayerKind::indirect,
                     layer_from_values(indirect_values(yarns->data(), true), base.texels()));
  }
  auto& place = sides[index_of(other.side) - 1];
  place = std::make_shared<const Fabric>(std::move(other));
}

FabricLevel shown_texels(const FabricLevel& level, const YarnMap& map, const V2i& first, const V2i& size,
                         int number) {
  return mean_texels(level, size, size * (1 << number),
                     [&](int x, int y) { return map.shown_at(first + V2i(x, y)); });
}

Fabric arranged(const Fabric& fabric) {
  if (fabric.find_map() == nullptr) return fabric;
  const auto& yarns = fabric.levels.front().yarns();
  const YarnMap& map = *fabric.find_map();
  const auto with_all_texels = [&](const Fabric& side) {
    Fabric result{side, {}, {}};
    result.levels.push_back(shown_texels(side.levels.front(), map, {0, 0}, map.size));
    for (int k = 1; k < level_count(map.size.x, map.size.y); ++k) {
      const FabricLevel& finer = result.levels.back();
      const V2i size(level_size(map.size.x, k), level_size(map.size.y, k));
      result.levels.push_back(mean_texels(finer, size, {finer.width, finer.height},
                                          [&](int x, int y) { return y * finer.width + x; }));
    }
    return result;
  };
  Fabric result = with_all_texels(fabric);
  result.levels.front().set_yarns(yarns);
  for (const Side side : other_sides)
    if (const Fabric* const other = fabric.find_side(side)) result.add_side(with_all_texels(*other));
  return result;
}

Fabric turned_over(const Fabric& fabric) {
  const auto pick = [](const Fabric* wanted, const Fabric* other, Side side) {
    Fabric result = wanted != nullptr ? *wanted : *other;
    result.side = side;
    return result;
  };
  const Fabric* const back = fabric.find_side(Side::back);
  Fabric turned = pick(back, &fabric, Side::front);
  FabricLevel& base = turned.levels.front();
  base.set_yarns(nullptr);
  if (const auto& yarns = fabric.levels.front().yarns())
    base.set_yarns(std::make_shared<const Yarns>(turned_over(*yarns, fabric.thickness_mm), yarns->period()));
  const Fabric* through = fabric.find_side(Side::through);
  const Fabric* const back_through = fabric.find_side(Side::back_through);
  // It gets the opacity of other views.
  if (through != nullptr && through->views != turned.views) through = nullptr;
  turned.sides = {};
  if (back_through != nullptr || through != nullptr)
    turned.add_side(pick(back_through, through, Side::through));
  return turned;
}

std::shared_ptr<const ProductBases> shared_bases(const Fabric& fabric) {
  for (const FabricLevel& level : fabric.levels)
    if (level.has(LayerKind::products)) return level.bases;
  return nullptr;
}

LayerShape layer_shape_of(const Fabric& fabric) {
  LayerShape shape{.side = fabric.side,
                   .views = fabric.views.count(),
                   .lights = fabric.lights.count(),
                   .level0_texel_count = fabric.levels.front().texels()};
  for (const FabricLevel& level : fabric.levels) {
    if (level.has(LayerKind::lobes)) shape.lobes = level.lobe_count();
    if (level.yarns()) shape.yarns = counts_of(level.yarns()->data());
    shape.products = std::max(shape.products, level[LayerKind::products].channels);
  }
  if (const auto bases = shared_bases(fabric)) {
    shape.view_functions = static_cast<int>(bases->view.size()) / shape.views;
    shape.light_functions = static_cast<int>(bases->light.size()) / shape.lights;
  }
  return shape;
}

V3f tangent_of(const V3f& normal) {
  // Normalised in double: a normal rounded to half precision is not unit, which matters near the axis.
  const V3d n = V3d(normal).normalized();
  V3d t = V3d(1, 0, 0) - n * n.x;
  // Nearer to the axis, the difference has too few digits for a direction.
  if (t.length2() < 1e-6) t = V3d(0, 1, 0) - n * n.y;
  return V3f(t.normalized());
}

}  // namespace selvedge
