#include "format/fabric/layers.h"

#include <fmt/format.h>

#include <algorithm>

#include "format/fabric/names.h"

namespace selvedge {
namespace {

constexpr std::array layer_parts{names::part_lobes,    names::part_frame, names::part_table,
                                 names::part_opacity,  names::part_light, names::part_heights,
                                 names::part_products, names::part_bases};
static_assert(layer_parts.size() == all_layers.size());

std::size_t size(int count) { return static_cast<std::size_t>(count); }

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

void set_heights(FabricLevel& level, const SlabShape& shape,
                 const std::vector<const std::vector<float>*>& planes) {
  std::vector<float> top;
  std::vector<float> bottom;
  for (std::size_t texel = 0; texel < planes.front()->size(); ++texel) {
    for (std::size_t c = 0; c < planes.size(); c += 2) {
      top.push_back((*planes[c])[texel]);
      bottom.push_back((*planes[c + 1])[texel]);
    }
  }
  level.heights.emplace(shape, std::move(top), std::move(bottom));
}

void set_bases(FabricLevel& level, const LayerShape& shape,
               const std::vector<const std::vector<float>*>& planes) {
  std::vector<float> values;
  for (const std::vector<float>* plane : planes) values.insert(values.end(), plane->begin(), plane->end());
  const std::size_t of_views = size(shape.view_functions) * size(shape.views);
  const std::size_t of_lights = size(shape.light_functions) * size(shape.lights);
  ProductBases bases;
  bases.view.assign(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(of_views));
  for (std::size_t i = 0; i < of_lights; ++i) {
    const float* colour = &values[of_views + 3 * i];
    bases.light.emplace_back(colour[0], colour[1], colour[2]);
  }
  level.bases = std::make_shared<const ProductBases>(std::move(bases));
}

}  // namespace

const char* name_of(Layer layer) { return layer_parts[index_of(layer)]; }

std::optional<Layer> layer_named(std::string_view name) {
  for (const Layer layer : all_layers) {
    if (name == name_of(layer)) return layer;
  }
  return std::nullopt;
}

std::size_t channel_count(Layer layer, const LayerShape& shape) {
  switch (layer) {
    case Layer::lobes:
      return 3 * size(parameter_count(shape.lobes));
    case Layer::frame:
      return names::frame_channels.size();
    case Layer::table:
      return 3 * size(shape.views);
    case Layer::opacity:
      return size(shape.views);
    case Layer::light:
      return 3 * size(shape.lights);
    case Layer::heights:
      return 2 * size(shape.cells.entries());
    case Layer::products:
      return size(shape.products);
    case Layer::bases:
      break;
  }
  const std::size_t values =
      size(shape.view_functions) * size(shape.views) + 3 * size(shape.light_functions) * size(shape.lights);
  return (values + size(shape.base_texels) - 1) / size(shape.base_texels);
}

std::vector<std::string> channel_names(Layer layer, const LayerShape& shape) {
  const char* part = name_of(layer);
  std::vector<std::string> channels;
  const auto add_table = [&](int directions) {
    for (int d = 0; d < directions; ++d) {
      for (const char* colour : names::colour_suffix) {
        channels.push_back(fmt::format("{}.{:04}.{}", part, d, colour));
      }
    }
  };
  switch (layer) {
    case Layer::lobes:
      for (const char* colour : names::colour_suffix) {
        channels.push_back(fmt::format("{}.diffuse.{}", part, colour));
        for (int j = 0; j < shape.lobes; ++j) {
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
      add_table(shape.views);
      break;
    case Layer::opacity:
      for (int v = 0; v < shape.views; ++v) channels.push_back(fmt::format("{}.{:04}", part, v));
      break;
    case Layer::light:
      add_table(shape.lights);
      break;
    case Layer::heights:
      for (int entry = 0; entry < shape.cells.entries(); ++entry) {
        for (const char* end : names::height_ends) {
          channels.push_back(fmt::format("{}.{}.{}", part, entry, end));
        }
      }
      break;
    case Layer::products:
    case Layer::bases:
      for (std::size_t i = 0; i < channel_count(layer, shape); ++i) {
        channels.push_back(fmt::format("{}.{}", part, i));
      }
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
      return level.opacity.has_value();
    case Layer::light:
      return level.light_table.has_value();
    case Layer::heights:
      return level.heights.has_value();
    case Layer::products:
      return level.products.has_value();
    case Layer::bases:
      break;
  }
  return level.bases != nullptr;
}

float value_of(const FabricLevel& level, Layer layer, const LayerShape& shape, std::size_t texel,
               std::size_t channel) {
  const std::size_t index = texel * channel_count(layer, shape) + channel;
  const int axis = static_cast<int>(channel % 3);
  switch (layer) {
    case Layer::lobes:
      return level.lobes->parameters[index];
    case Layer::frame:
      return channel < 3 ? level.frame->normal[texel][axis] : level.frame->tangent[texel][axis];
    case Layer::table:
      return level.view_table->colour[index / 3][axis];
    case Layer::opacity:
      return level.opacity->opacity[index];
    case Layer::light:
      return level.light_table->value[index / 3][axis];
    case Layer::heights:
      return (channel % 2 == 0 ? level.heights->top() : level.heights->bottom())[index / 2];
    case Layer::products: {
      const std::size_t own = size(level.products->entries) * level.products->pairs.size();
      return channel < own ? level.products->coefficient[texel * own + channel] : 0;
    }
    case Layer::bases:
      break;
  }
  const ProductBases& bases = *level.bases;
  const std::size_t value = channel * size(shape.base_texels) + texel;
  if (value < bases.view.size()) return bases.view[value];
  const std::size_t light = value - bases.view.size();
  return light < 3 * bases.light.size() ? bases.light[light / 3][static_cast<int>(light % 3)] : 0;
}

ExrPixels pixels_of(const FabricLevel& level, Layer layer, const LayerShape& shape) {
  const auto texels = static_cast<std::size_t>(level.texels());
  const std::size_t channels = channel_count(layer, shape);
  ExrPixels pixels{level.width, level.height,
                   std::vector<std::vector<float>>(channels, std::vector<float>(texels))};
  if (!has_layer(level, layer)) return pixels;
  for (std::size_t texel = 0; texel < texels; ++texel) {
    for (std::size_t channel = 0; channel < channels; ++channel) {
      pixels.planes[channel][texel] = value_of(level, layer, shape, texel, channel);
    }
  }
  return pixels;
}

void set_layer(FabricLevel& level, Layer layer, const LayerShape& shape,
               const std::vector<const std::vector<float>*>& planes, const std::vector<V2i>& pairs,
               int entries) {
  switch (layer) {
    case Layer::lobes:
      level.lobes = LobeLayer{shape.lobes, values_of(planes)};
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
    case Layer::light:
      level.light_table = LightTableLayer{vectors_of(planes, 0, 3)};
      break;
    case Layer::heights:
      set_heights(level, shape.cells, planes);
      break;
    case Layer::products:
      level.products = ProductLayer{entries, pairs, {}};
      for (std::size_t texel = 0; texel < size(level.texels()); ++texel) {
        for (std::size_t i = 0; i < size(entries) * pairs.size(); ++i) {
          level.products->coefficient.push_back((*planes[i])[texel]);
        }
      }
      break;
    case Layer::bases:
      set_bases(level, shape, planes);
      break;
  }
}

}  // namespace selvedge
