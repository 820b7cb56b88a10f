#include "format/fabric.h"

#include <fmt/format.h>

#include <cmath>

namespace selvedge {
namespace {

tl::unexpected<Error> broken(int level, const char* layer, std::string message) {
  return fail(Code::fabric_malformed, {}, fmt::format("level {}/{}", level, layer), std::move(message));
}

tl::unexpected<Error> not_finite(int level, const char* layer, std::size_t texel, const FabricLevel& size,
                                 std::string message) {
  const auto width = static_cast<std::size_t>(size.width);
  return fail(Code::fabric_not_finite, {},
              fmt::format("level {}/{}/texel {},{}", level, layer, texel % width, texel / width),
              std::move(message));
}

bool is_finite(const V3f& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

Result<void> validate_lobes(const FabricLevel& level, int k, const FabricLimits& limits) {
  const LobeLayer& layer = *level.lobes;
  if (layer.lobes < 0 || layer.lobes > limits.lobes) {
    return broken(k, "lobes", fmt::format("{} lobes; 0 to {} are allowed", layer.lobes, limits.lobes));
  }
  const auto stride = static_cast<std::size_t>(3 * parameter_count(layer.lobes));
  if (layer.parameters.size() != stride * static_cast<std::size_t>(level.texels())) {
    return broken(k, "lobes", "wrong number of values");
  }
  for (std::size_t i = 0; i < layer.parameters.size(); ++i) {
    const float value = layer.parameters[i];
    const std::size_t within = i % (stride / 3);
    if (!std::isfinite(value)) return not_finite(k, "lobes", i / stride, level, "value is not finite");
    const bool is_exponent = within != 0 && (within - 1) % 4 == 3;
    if ((within == 0 || is_exponent) && value < 0) {
      return not_finite(k, "lobes", i / stride, level,
                        is_exponent ? "exponent is negative" : "diffuse term is negative");
    }
  }
  return {};
}

Result<void> validate_frame(const FabricLevel& level, int k) {
  const FrameLayer& layer = *level.frame;
  const auto texels = static_cast<std::size_t>(level.texels());
  if (layer.normal.size() != texels || layer.tangent.size() != texels) {
    return broken(k, "frame", "wrong number of values");
  }
  // Half precision leaves 3 digits; a frame worse than this was not written as a frame.
  constexpr float tolerance = 0.01F;
  for (std::size_t i = 0; i < texels; ++i) {
    const V3f& n = layer.normal[i];
    const V3f& t = layer.tangent[i];
    if (!is_finite(n) || !is_finite(t)) return not_finite(k, "frame", i, level, "value is not finite");
    if (std::abs(n.length() - 1) > tolerance || std::abs(t.length() - 1) > tolerance ||
        std::abs(n.dot(t)) > tolerance) {
      return not_finite(k, "frame", i, level, "normal and tangent are not unit and perpendicular");
    }
  }
  return {};
}

Result<void> validate_tables(const FabricLevel& level, int k, std::size_t views) {
  const std::size_t entries = static_cast<std::size_t>(level.texels()) * views;
  if (level.view_table) {
    if (level.view_table->colour.size() != entries) return broken(k, "table", "wrong number of values");
    for (std::size_t i = 0; i < entries; ++i) {
      const V3f& c = level.view_table->colour[i];
      if (!is_finite(c) || c.x < 0 || c.y < 0 || c.z < 0) {
        return not_finite(k, "table", i / views, level, "value is negative or not finite");
      }
    }
  }
  if (level.opacity) {
    if (level.opacity->opacity.size() != entries) return broken(k, "opacity", "wrong number of values");
    for (std::size_t i = 0; i < entries; ++i) {
      const float a = level.opacity->opacity[i];
      if (!(a >= 0 && a <= 1))
        return not_finite(k, "opacity", i / views, level, "value is outside of [0, 1]");
    }
  }
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
    if (level.lobes) {
      if (auto ok = validate_lobes(level, k, limits); !ok) return ok;
    }
    if (level.frame) {
      if (auto ok = validate_frame(level, k); !ok) return ok;
    }
    if (auto ok = validate_tables(level, k, static_cast<std::size_t>(views.count())); !ok) return ok;
  }
  return {};
}

}  // namespace selvedge
