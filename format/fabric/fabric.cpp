#include "format/fabric/fabric.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/fabric/level_values.h"

namespace selvedge {
namespace {

tl::unexpected<Error> broken(int level, const char* layer, std::string message) {
  return fail(Code::fabric_malformed, {}, fmt::format("level {}/{}", level, layer), std::move(message));
}

/// Checks the numbers of lobes, products and functions.
Result<void> validate_counts(const FabricLevel& level, int k, LayerKind kind, const LayerShape& shape,
                             const FabricLimits& limits) {
  const auto check = [&](const char* what, int count, int min, int max) -> Result<void> {
    if (count >= min && count <= max) return {};
    return broken(k, name_of(kind), fmt::format("{} {}; {} to {} are allowed", count, what, min, max));
  };
  if (kind == LayerKind::lobes) return check("lobes", shape.lobes, 0, limits.lobes);
  if (kind == LayerKind::bases) {
    if (auto ok = check("functions of the view", shape.view_functions, 0, limits.functions); !ok) return ok;
    return check("functions of the light", shape.light_functions, 1, limits.functions);
  }
  if (kind != LayerKind::products) return {};
  if (!level.bases) return broken(k, "products", "there are no bases");
  for (const V2i& pair : level.pairs)
    if (pair.x < 0 || pair.x > shape.view_functions || pair.y < 0 || pair.y >= shape.light_functions)
      return broken(k, "products", fmt::format("the pair ({}, {}) is not in the bases", pair.x, pair.y));
  return check("products", static_cast<int>(level.pairs.size()), 1, limits.products);
}

Result<void> validate_layer(const FabricLevel& level, int k, LayerKind kind, const LayerShape& shape,
                            const FabricLimits& limits) {
  if (auto ok = validate_counts(level, k, kind, shape, limits); !ok) return ok;
  const int channels = kind == LayerKind::products
                           ? static_cast<int>(level.pairs.size())  // the part: or more
                           : channel_count(kind, shape);
  const bool complete =
      kind == LayerKind::bases
          ? level.bases->view.size() % shape.views == 0 && level.bases->light.size() % shape.lights == 0
          : level[kind].channels == channels &&
                level[kind].values.size() == std::size_t{1} * level.texels() * level[kind].channels;
  if (!complete) return broken(k, name_of(kind), "wrong number of values");
  if (kind == LayerKind::bases) return {};  // validate_bases()
  IssueSink sink({});
  check_values(level, k, kind, shape, sink);
  if (sink.has_error()) return tl::unexpected(sink.first_error());
  return {};
}

Result<void> validate_grid(const char* name, const DirectionGrid& grid, const FabricLimits& limits) {
  if (grid.columns >= 1 && grid.rows >= 1 && grid.columns <= limits.directions &&
      grid.rows <= limits.directions / grid.columns)
    return {};
  return fail(
      Code::fabric_malformed, {}, name,
      fmt::format("{}x{} directions; 1 to {} are allowed", grid.columns, grid.rows, limits.directions));
}

/// Checks that the functions are finite and the same in all levels.
Result<void> validate_bases(const Fabric& fabric) {
  const auto first = shared_bases(fabric);
  if (!first) return {};
  for (const FabricLevel& level : fabric.levels) {
    if (!level.has(LayerKind::products) || level.bases == first) continue;
    if (level.bases->view != first->view || level.bases->light != first->light)
      return fail(Code::fabric_malformed, {}, "bases", "levels differ in their bases");
  }
  const auto finite = [](float value) { return std::isfinite(value); };
  if (std::ranges::all_of(first->view, finite) && std::ranges::all_of(first->light, [&](const V3f& c) {
        return finite(c.x) && finite(c.y) && finite(c.z);
      }))
    return {};
  return fail(Code::fabric_not_finite, {}, "bases", "a value is not finite");
}

}  // namespace

bool FabricLevel::has_reflectance() const {
  constexpr std::array kinds{LayerKind::lobes, LayerKind::frame, LayerKind::table, LayerKind::light,
                             LayerKind::products};
  return std::ranges::any_of(kinds, [&](LayerKind kind) { return has(kind); });
}

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
        const int at = std::min(y >> steps, coarser.height - 1) * coarser.width +
                       std::min(x >> steps, coarser.width - 1);
        const auto first = from.values.begin() + std::ptrdiff_t{at} * from.channels;
        layer.values.insert(layer.values.end(), first, first + from.channels);
      }
    }
    set_layer(kind, std::move(layer));
  }
}

void FabricLevel::set_layer(LayerKind kind, Layer layer) { layers_[index_of(kind)] = std::move(layer); }

void FabricLevel::set_yarns(std::shared_ptr<const Yarns> yarns) {
  remove_layer(LayerKind::yarns);
  remove_layer(LayerKind::indirect);
  yarns_ = std::move(yarns);
  if (!yarns_) return;
  set_layer(LayerKind::yarns, layer_from_values(curve_values(yarns_->data()), texels()));
  set_layer(LayerKind::indirect, layer_from_values(indirect_values(yarns_->data()), texels()));
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

void FabricLevel::add_layer(LayerKind kind, int channels, float value) {
  set_layer(kind, {channels, std::vector<float>(std::size_t{1} * texels() * channels, value)});
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

Result<void> validate(const Fabric& fabric, const FabricLimits& limits) {
  if (fabric.levels.empty()) return fail(Code::fabric_malformed, {}, "levels", "the fabric has no level");
  if (!(fabric.period_mm.x > 0 && fabric.period_mm.y > 0) || !std::isfinite(fabric.period_mm.x) ||
      !std::isfinite(fabric.period_mm.y))
    return fail(Code::fabric_malformed, {}, "period_mm", "not a positive size");
  if (!std::isfinite(fabric.reference_height) || !(fabric.thickness_mm >= 0) ||
      !std::isfinite(fabric.thickness_mm))
    return fail(Code::fabric_malformed, {}, "reference_height", "heights are not finite");
  if (!(fabric.radiance_scale > 0) || !std::isfinite(fabric.radiance_scale))
    return fail(Code::fabric_malformed, {}, "radiance_scale", "is not a positive number");
  if (auto ok = validate_grid("views", fabric.views, limits); !ok) return ok;
  if (auto ok = validate_grid("lights", fabric.lights, limits); !ok) return ok;
  const FabricLevel& base = fabric.levels.front();
  if (base.width < 1 || base.height < 1 || base.width > limits.texels_per_side ||
      base.height > limits.texels_per_side)
    return broken(0, "size",
                  fmt::format("{}x{} texels; 1 to {} a side are allowed", base.width, base.height,
                              limits.texels_per_side));
  if (static_cast<int>(fabric.levels.size()) > level_count(base.width, base.height))
    return fail(Code::fabric_malformed, {}, "levels", "more levels than down to 1x1");
  const LayerShape shape = layer_shape_of(fabric);
  for (int k = 0; k < static_cast<int>(fabric.levels.size()); ++k) {
    const FabricLevel& level = fabric.levels[k];
    if (level.width != level_size(base.width, k) || level.height != level_size(base.height, k))
      return broken(k, "size", fmt::format("{}x{} does not follow from level 0", level.width, level.height));
    if (level.has(LayerKind::lobes) && level.lobe_count() != shape.lobes)
      return broken(k, "lobes", "levels differ in their number of lobes");
    if (level.yarns()) {
      if (k != 0) return broken(k, "yarns", "only level 0 has yarn");
      if (auto ok = validate(level.yarns()->data(), fabric.period_mm); !ok) return ok;
    }
    if (fabric.side != Side::front && !level.has_reflectance())
      return broken(k, name_of(fabric.side), "it has no layer of its own");
    for (const LayerKind kind : all_layers) {
      if (kind == LayerKind::indirect && fabric.side == Side::through) continue;  // checked with the yarn
      if (!level.has(kind) || (kind == LayerKind::bases && !level.has(LayerKind::products))) continue;
      if (auto ok = validate_layer(level, k, kind, shape, limits); !ok) return ok;
    }
  }
  for (const auto& other : fabric.sides) {
    if (!other) continue;
    if (other->levels.size() != fabric.levels.size() || other->texels() != fabric.texels())
      return fail(Code::fabric_malformed, {}, name_of(other->side), "its levels differ from the front's");
    const Fabric* const seen = other->side == Side::back_through ? fabric.find_side(Side::back) : &fabric;
    if (seen == nullptr || (is_transmission(other->side) && other->views != seen->views))
      return fail(Code::fabric_malformed, {}, fmt::format("{}/views", name_of(other->side)),
                  "differ from the visible side's");
    if (auto ok = validate(*other, limits); !ok) return ok;
  }
  return validate_bases(fabric);
}

}  // namespace selvedge
