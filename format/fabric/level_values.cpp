#include "format/fabric/level_values.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace selvedge {
namespace {

/// The bases as a layer; empty for other kinds.
Layer spread_bases(const FabricLevel& level, LayerKind kind) {
  if (kind != LayerKind::bases || !level.bases) return {};
  std::vector<float> values = level.bases->view;
  const std::span<const float> light = floats_of(level.bases->light);
  values.insert(values.end(), light.begin(), light.end());
  return layer_from_values(values, level.texels());
}

/// The values of the bases are stored one after the other in the pixels of level 0, channel by channel.
std::shared_ptr<const ProductBases> shared_bases(const std::vector<const std::vector<float>*>& planes,
                                                 const LayerShape& shape) {
  std::vector<float> values;
  for (const std::vector<float>* plane : planes) values.insert(values.end(), plane->begin(), plane->end());
  const auto colours = values.begin() + shape.view_functions * shape.views;
  ProductBases bases;
  bases.view.assign(values.begin(), colours);
  for (int i = 0; i < shape.light_functions * shape.lights; ++i)
    bases.light.emplace_back(colours[3 * i], colours[3 * i + 1], colours[3 * i + 2]);
  return std::make_shared<const ProductBases>(std::move(bases));
}

/// Half precision has 3 digits: a larger error cannot be due to rounding.
constexpr float frame_tolerance = 0.01F;

/// The values of a layer that are spread over the texels of level 0.
std::vector<float> gathered(const FabricLevel& level, LayerKind kind) {
  const Layer& layer = level[kind];
  std::vector<float> values;
  for (int i = 0; i < layer.channels; ++i)
    for (int texel = 0; texel < level.texels(); ++texel)
      values.push_back(layer.values[std::size_t{1} * texel * layer.channels + i]);
  return values;
}

}  // namespace

Layer layer_from_values(const std::vector<float>& values, int texels) {
  Layer layer;
  layer.channels = static_cast<int>((values.size() + texels - 1) / texels);
  layer.values.assign(std::size_t{1} * layer.channels * texels, 0);
  for (std::size_t i = 0; i < values.size(); ++i)
    layer.values[i % texels * layer.channels + i / texels] = values[i];
  return layer;
}

ExrPixels layer_pixels(const FabricLevel& level, LayerKind kind, const LayerShape& shape) {
  const std::size_t texels = level.texels();
  ExrPixels pixels{level.width, level.height,
                   std::vector<std::vector<float>>(channel_count(kind, shape), std::vector<float>(texels))};
  const Layer bases = spread_bases(level, kind);
  const Layer& layer = bases.channels > 0 ? bases : level[kind];
  const float* value = layer.values.data();
  for (std::size_t texel = 0; layer.channels > 0 && texel < texels; ++texel)
    for (int i = 0; i < layer.channels; ++i) pixels.planes[i][texel] = *value++;
  return pixels;
}

void set_layer_pixels(FabricLevel& level, LayerKind kind, const LayerShape& shape,
                      const std::vector<const std::vector<float>*>& planes) {
  if (kind == LayerKind::bases) {
    level.bases = shared_bases(planes, shape);
    return;
  }
  Layer layer;
  layer.channels = static_cast<int>(kind == LayerKind::products ? level.pairs.size() : planes.size());
  layer.values.reserve(std::size_t{1} * level.texels() * layer.channels);
  for (int texel = 0; texel < level.texels(); ++texel)
    for (int i = 0; i < layer.channels; ++i) layer.values.push_back((*planes[i])[texel]);
  level.set_layer(kind, std::move(layer));
}

void restore_yarns(FabricLevel& level, const LayerShape& shape, const V2f& repeat, std::uint64_t memory,
                   IssueSink& sink) {
  YarnMap map;
  if (level.has(LayerKind::map))
    map = map_from_values(gathered(level, LayerKind::map), shape.yarns, {level.width, level.height});
  const V2f period = map.yarn_period(repeat);
  auto data = yarns_from_values(gathered(level, LayerKind::yarns), gathered(level, LayerKind::indirect),
                                shape.yarns, period, std::move(map));
  if (!data) {
    sink.add(data.error().code, fmt::format("{}/{}", name_of(LayerKind::yarns), data.error().place),
             data.error().message);
    return;
  }
  if (yarn_memory_bytes(*data, period) > static_cast<double>(memory)) {
    const Error beyond = memory_limit_error("", name_of(LayerKind::yarns), "the cells of the yarn", memory);
    return sink.add(beyond.code, beyond.place, beyond.message);
  }
  level.set_yarns(std::make_shared<const Yarns>(std::move(*data), period));
}

void restore_light_through(FabricLevel& front, const FabricLevel& through) {
  if (!front.yarns() || !through.has(LayerKind::indirect)) return;
  YarnData data = front.yarns()->data();
  set_light_through(data, gathered(through, LayerKind::indirect));
  front.set_yarns(std::make_shared<const Yarns>(std::move(data), front.yarns()->period()));
}

void check_values(const FabricLevel& level, int level_index, LayerKind kind, const LayerShape& shape,
                  IssueSink& sink) {
  constexpr int max_named = 8;
  int count = 0;
  const auto add = [&](const std::string& channel, std::size_t texel, std::string message) {
    sink.add(Code::fabric_not_finite,
             fmt::format("{}/level {}/{}/{},{}", part_name(kind, shape.side), level_index, channel,
                         texel % level.width, texel / level.width),
             std::move(message));
  };
  const auto check = [&](const ValueRange& range, int channel, std::size_t texel, float value) {
    if (range.contains(value) || ++count > max_named) return;
    add(channel_name(kind, shape, channel), texel, fmt::format("{} {}", value, range.fault_message));
  };
  const std::size_t texels = level.texels();
  const Layer bases = spread_bases(level, kind);
  const Layer& layer = bases.channels > 0 ? bases : level[kind];
  std::vector<ValueRange> ranges;
  for (int i = 0; i < layer.channels; ++i) ranges.push_back(value_range(kind, shape, i));
  const float* value = layer.values.data();
  for (std::size_t texel = 0; texel < texels; ++texel)
    for (int i = 0; i < layer.channels; ++i) check(ranges[i], i, texel, *value++);
  if (kind == LayerKind::frame) {
    for (std::size_t texel = 0; texel < texels; ++texel) {
      const auto& [n, t] = level.frame()[texel];
      const float fault = std::max({std::abs(n.length() - 1), std::abs(t.length() - 1), std::abs(n.dot(t))});
      // Values that are not finite are reported above.
      if (!std::isfinite(n.length2() + t.length2()) || fault <= frame_tolerance || ++count > max_named)
        continue;
      add("frame", texel, "normal and tangent are not unit and perpendicular");
    }
  }
  if (count > max_named)
    sink.add(Code::fabric_not_finite, fmt::format("{}/level {}", part_name(kind, shape.side), level_index),
             fmt::format("{} more values break the rules", count - max_named));
}

}  // namespace selvedge
