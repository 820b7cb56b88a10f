#include "format/fabric_layout.h"

#include <fmt/format.h>

#include <algorithm>

#include "format/fabric_names.h"

namespace selvedge {
namespace {

constexpr std::array<const char*, 4> layer_parts{names::part_lobes, names::part_frame, names::part_table,
                                                 names::part_opacity};

std::vector<V3f> vectors_of(const std::vector<const std::vector<float>*>& planes, std::size_t first,
                            std::size_t stride) {
  const std::size_t texels = planes.front()->size();
  std::vector<V3f> vectors;
  vectors.reserve(texels * planes.size() / stride);
  for (std::size_t texel = 0; texel < texels; ++texel) {
    for (std::size_t c = first; c + 2 < planes.size(); c += stride) {
      vectors.emplace_back((*planes[c])[texel], (*planes[c + 1])[texel], (*planes[c + 2])[texel]);
    }
  }
  return vectors;
}

std::vector<float> values_of(const std::vector<const std::vector<float>*>& planes) {
  const std::size_t texels = planes.front()->size();
  std::vector<float> values(texels * planes.size());
  for (std::size_t texel = 0; texel < texels; ++texel) {
    for (std::size_t c = 0; c < planes.size(); ++c) values[texel * planes.size() + c] = (*planes[c])[texel];
  }
  return values;
}

}  // namespace

const char* name_of(Layer layer) { return layer_parts[index_of(layer)]; }

std::optional<Layer> layer_named(std::string_view name) {
  for (const Layer layer : all_layers) {
    if (name == name_of(layer)) return layer;
  }
  return std::nullopt;
}

std::size_t channel_count(Layer layer, int lobes, int views) {
  switch (layer) {
    case Layer::lobes:
      return 3 * static_cast<std::size_t>(parameter_count(lobes));
    case Layer::frame:
      return names::frame_channels.size();
    case Layer::table:
      return 3 * static_cast<std::size_t>(views);
    case Layer::opacity:
      break;
  }
  return static_cast<std::size_t>(views);
}

std::vector<std::string> channel_names(Layer layer, int lobes, int views) {
  const char* part = name_of(layer);
  std::vector<std::string> channels;
  switch (layer) {
    case Layer::lobes:
      for (const char* colour : names::colour_suffix) {
        channels.push_back(fmt::format("{}.diffuse.{}", part, colour));
        for (int j = 0; j < lobes; ++j) {
          for (const char* parameter : names::lobe_parameters) {
            channels.push_back(fmt::format("{}.{}.{}.{}", part, j, parameter, colour));
          }
        }
      }
      break;
    case Layer::frame:
      channels.assign(names::frame_channels.begin(), names::frame_channels.end());
      break;
    case Layer::table:
      for (int v = 0; v < views; ++v) {
        for (const char* colour : names::colour_suffix) {
          channels.push_back(fmt::format("{}.{:04}.{}", part, v, colour));
        }
      }
      break;
    case Layer::opacity:
      for (int v = 0; v < views; ++v) channels.push_back(fmt::format("{}.{:04}", part, v));
      break;
  }
  return channels;
}

bool has_layer(const FabricLevel& level, Layer layer) {
  switch (layer) {
    case Layer::lobes:
      return level.lobes.has_value();
    case Layer::frame:
      return level.frame.has_value();
    case Layer::table:
      return level.view_table.has_value();
    case Layer::opacity:
      break;
  }
  return level.opacity.has_value();
}

float value_of(const FabricLevel& level, Layer layer, std::size_t texel, std::size_t channel,
               std::size_t channels) {
  const std::size_t index = texel * channels + channel;
  const int axis = static_cast<int>(channel % 3);
  switch (layer) {
    case Layer::lobes:
      return level.lobes->parameters[index];
    case Layer::frame:
      return channel < 3 ? level.frame->normal[texel][axis] : level.frame->tangent[texel][axis];
    case Layer::table:
      return level.view_table->colour[index / 3][axis];
    case Layer::opacity:
      break;
  }
  return level.opacity->opacity[index];
}

ExrPixels pixels_of(const FabricLevel& level, Layer layer, int lobes, int views) {
  const auto texels = static_cast<std::size_t>(level.texels());
  const std::size_t channels = channel_count(layer, lobes, views);
  ExrPixels pixels{level.width, level.height,
                   std::vector<std::vector<float>>(channels, std::vector<float>(texels))};
  if (!has_layer(level, layer)) return pixels;
  for (std::size_t texel = 0; texel < texels; ++texel) {
    for (std::size_t channel = 0; channel < channels; ++channel) {
      pixels.planes[channel][texel] = value_of(level, layer, texel, channel, channels);
    }
  }
  return pixels;
}

void set_layer(FabricLevel& level, Layer layer, int lobes,
               const std::vector<const std::vector<float>*>& planes) {
  switch (layer) {
    case Layer::lobes:
      level.lobes = LobeLayer{lobes, values_of(planes)};
      break;
    case Layer::frame:
      level.frame = FrameLayer{vectors_of(planes, 0, 6), vectors_of(planes, 3, 6)};
      break;
    case Layer::table:
      level.view_table = ViewTableLayer{vectors_of(planes, 0, 3)};
      break;
    case Layer::opacity:
      level.opacity = OpacityLayer{values_of(planes)};
      break;
  }
}

}  // namespace selvedge
