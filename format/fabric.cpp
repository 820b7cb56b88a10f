#include "format/fabric.h"

#include <fmt/format.h>

#include <cmath>

#include "format/fabric_layout.h"
#include "format/fabric_values.h"

namespace selvedge {
namespace {

tl::unexpected<Error> broken(int level, const char* layer, std::string message) {
  return fail(Code::fabric_malformed, {}, fmt::format("level {}/{}", level, layer), std::move(message));
}

/// Whether the arrays of a layer are as long as its values are many.
bool is_complete(const FabricLevel& level, Layer layer, std::size_t views) {
  const auto texels = static_cast<std::size_t>(level.texels());
  switch (layer) {
    case Layer::lobes:
      return level.lobes->parameters.size() ==
             texels * channel_count(layer, level.lobes->lobes, static_cast<int>(views));
    case Layer::frame:
      return level.frame->normal.size() == texels && level.frame->tangent.size() == texels;
    case Layer::table:
      return level.view_table->colour.size() == texels * views;
    case Layer::opacity:
      break;
  }
  return level.opacity->opacity.size() == texels * views;
}

Result<void> validate_layer(const FabricLevel& level, int k, Layer layer, int views,
                            const FabricLimits& limits) {
  if (layer == Layer::lobes && (level.lobes->lobes < 0 || level.lobes->lobes > limits.lobes)) {
    return broken(k, "lobes", fmt::format("{} lobes; 0 to {} are allowed", level.lobes->lobes, limits.lobes));
  }
  if (!is_complete(level, layer, static_cast<std::size_t>(views))) {
    return broken(k, name_of(layer), "wrong number of values");
  }
  IssueSink sink({});
  check_values(level, k, layer, views, sink);
  if (sink.has_error()) return tl::unexpected(sink.first_error());
  return {};
}

}  // namespace

int level_count(int width, int height) {
  int count = 1;
  while (level_size(width, count - 1) > 1 || level_size(height, count - 1) > 1) ++count;
  return count;
}

V3f tangent_of(const V3f& normal) {
  // Unit in double: a normal rounded to half precision is not, and near the axis the difference would show
  // it.
  const V3d n = V3d(normal).normalized();
  V3d t = V3d(1, 0, 0) - n * n.x;
  // Nearer than this to the axis the difference has no digits left to give a direction.
  if (t.length2() < 1e-6) t = V3d(0, 1, 0) - n * n.y;
  return V3f(t.normalized());
}

Result<void> validate(const Fabric& fabric, const FabricLimits& limits) {
  if (fabric.levels.empty()) return fail(Code::fabric_malformed, {}, "levels", "the fabric has no level");
  if (!(fabric.period_mm.x > 0 && fabric.period_mm.y > 0) || !std::isfinite(fabric.period_mm.x) ||
      !std::isfinite(fabric.period_mm.y)) {
    return fail(Code::fabric_malformed, {}, "period_mm", "not a positive size");
  }
  if (!std::isfinite(fabric.reference_height) || !(fabric.thickness_mm >= 0) ||
      !std::isfinite(fabric.thickness_mm)) {
    return fail(Code::fabric_malformed, {}, "reference_height", "heights are not finite");
  }
  const DirectionGrid& views = fabric.views;
  if (views.columns < 1 || views.rows < 1 || views.columns > limits.directions ||
      views.rows > limits.directions / views.columns) {
    return fail(
        Code::fabric_malformed, {}, "views",
        fmt::format("{}x{} directions; 1 to {} are allowed", views.columns, views.rows, limits.directions));
  }
  const FabricLevel& base = fabric.levels.front();
  if (base.width < 1 || base.height < 1 || base.width > limits.texels_per_side ||
      base.height > limits.texels_per_side) {
    return broken(0, "size",
                  fmt::format("{}x{} texels; 1 to {} a side are allowed", base.width, base.height,
                              limits.texels_per_side));
  }
  if (static_cast<int>(fabric.levels.size()) > level_count(base.width, base.height)) {
    return fail(Code::fabric_malformed, {}, "levels", "more levels than down to 1x1");
  }
  for (int k = 0; k < static_cast<int>(fabric.levels.size()); ++k) {
    const FabricLevel& level = fabric.levels[static_cast<std::size_t>(k)];
    if (level.width != level_size(base.width, k) || level.height != level_size(base.height, k)) {
      return broken(k, "size", fmt::format("{}x{} does not follow from level 0", level.width, level.height));
    }
    for (const Layer layer : all_layers) {
      if (!has_layer(level, layer)) continue;
      if (auto ok = validate_layer(level, k, layer, views.count(), limits); !ok) return ok;
    }
  }
  return {};
}

}  // namespace selvedge
