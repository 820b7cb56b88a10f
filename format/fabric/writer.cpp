#include <Imath/half.h>
#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <optional>

#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/fabric/header.h"
#include "format/fabric/header_json.h"
#include "format/fabric/names.h"
#include "format/fabric/rules.h"
#include "format/fabric/warnings.h"

namespace selvedge {
namespace {

/// Whether the file has the layer at a level; the bases stand at level 0 for all.
bool is_stored(const Fabric& fabric, Layer layer, int k) {
  if (layer != Layer::bases) return has_layer(fabric.levels[k], layer);
  return k == 0 && std::any_of(fabric.levels.begin(), fabric.levels.end(),
                               [](const FabricLevel& level) { return level.products.has_value(); });
}

ExrPart part_of(const Fabric& fabric, const char* name, const FabricWriteOptions& options) {
  ExrPart part;
  part.name = name;
  part.width = fabric.levels.front().width;
  part.height = fabric.levels.front().height;
  part.compression = options.codec;
  part.attributes[names::attribute_wrap] = std::string(names::wrap_periodic);
  return part;
}

ExrPart data_part(const Fabric& fabric, Layer layer, const LayerShape& shape,
                  const FabricWriteOptions& options) {
  ExrPart part = part_of(fabric, name_of(layer), options);
  part.tiled = true;
  part.mipmapped = true;
  part.levels = level_count(part.width, part.height);
  for (const std::string& channel : channel_names(layer, shape)) {
    part.channels.push_back({channel, options.half.contains(layer)});
  }
  return part;
}

ExrPart preview_part(const Fabric& fabric, const FabricWriteOptions& options) {
  ExrPart part = part_of(fabric, names::part_preview, options);
  for (const char* channel : names::preview_channels) part.channels.push_back({channel});
  return part;
}

std::shared_ptr<const ProductBases> in_half_precision(const ProductBases& bases) {
  ProductBases rounded = bases;
  for (float& value : rounded.view) value = Imath::half(value);
  for (V3f& value : rounded.light) {
    for (int c = 0; c < 3; ++c) value[c] = Imath::half(value[c]);
  }
  return std::make_shared<const ProductBases>(std::move(rounded));
}

/// A level as it will be read: its own layers that are stored in 16 bits are rounded. The functions are the
/// file's, and laid out over the texels of its level 0.
FabricLevel as_stored(FabricLevel level, const LayerShape& shape, const LayerSet& half) {
  for (const Layer layer : all_layers) {
    if (layer == Layer::bases || !has_layer(level, layer) || !half.contains(layer)) continue;
    ExrPixels pixels = pixels_of(level, layer, shape);
    std::vector<const std::vector<float>*> planes;
    for (std::vector<float>& plane : pixels.planes) {
      for (float& value : plane) value = Imath::half(value);
      planes.push_back(&plane);
    }
    set_layer(level, layer, shape, planes, level.products ? level.products->pairs : std::vector<V2i>(),
              level.products ? level.products->entries : 1);
  }
  return level;
}

/// What every EXR viewer shows: level 0 seen along the normal under a white light from the upper left,
/// premultiplied, at the exposure under which a white Lambert cloth facing the light is 1.
ExrPixels preview_of(const FabricLevel& level, const Fabric& of) {
  ExrPixels pixels{level.width, level.height, std::vector<std::vector<float>>(4)};
  const V3f light = V3f(-0.4F, 0.5F, 0.8F).normalized();
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) {
      const Shading s = evaluate(level, of, x, y, light, {0, 0, 1});
      const V3f colour = s.radiance * (s.alpha * std::numbers::pi_v<float>);
      for (int c = 0; c < 3; ++c) {
        pixels.planes[c].push_back(std::min(colour[c], 1000.0F));
      }
      pixels.planes[3].push_back(s.alpha);
    }
  }
  return pixels;
}

/// The pixels of a level of the part, zeros where the fabric has no such level or layer.
ExrPixels pixels_at(const Fabric& fabric, Layer layer, const LayerShape& shape, int level) {
  if (layer != Layer::bases && level < static_cast<int>(fabric.levels.size())) {
    return pixels_of(fabric.levels[level], layer, shape);
  }
  FabricLevel stored;
  stored.width = level_size(fabric.levels.front().width, level);
  stored.height = level_size(fabric.levels.front().height, level);
  if (layer == Layer::bases && level == 0) {
    for (const FabricLevel& of : fabric.levels) {
      if (of.products) stored.bases = of.bases;
    }
  }
  return pixels_of(stored, layer, shape);
}

/// The layer's entry in the header, with the digests of its pixels.
LayerHeader entry_for(const Fabric& fabric, Layer layer, const LayerShape& shape, const ExrPart& part) {
  LayerHeader entry;
  entry.half = part.channels.empty() || part.channels.front().half;
  entry.lobes = shape.lobes;
  entry.cells = shape.cells;
  entry.view_functions = shape.view_functions;
  entry.light_functions = shape.light_functions;
  for (int k = 0; k < static_cast<int>(fabric.levels.size()); ++k) {
    if (!is_stored(fabric, layer, k)) continue;
    entry.levels.push_back(k);
    entry.digests.push_back(digest_of(part, pixels_at(fabric, layer, shape, k)));
    if (layer == Layer::products) {
      entry.pairs.push_back(fabric.levels[k].products->pairs);
    }
  }
  return entry;
}

}  // namespace

Issues precision_warnings(const std::string& path, const Fabric& fabric, const FabricWriteOptions& options) {
  IssueSink sink(path);
  for (std::size_t k = 0; k < fabric.levels.size(); ++k) {
    warn_of_precision(fabric.levels[k], static_cast<int>(k), options.half, sink);
  }
  return sink.take();
}

Fabric as_stored(const Fabric& fabric, const LayerSet& half) {
  const LayerShape shape = shape_of(fabric);
  Fabric result = fabric;
  std::shared_ptr<const ProductBases> bases;
  for (FabricLevel& level : result.levels) {
    level = as_stored(std::move(level), shape, half);
    if (!level.bases) continue;
    if (!bases) bases = half.contains(Layer::bases) ? in_half_precision(*level.bases) : level.bases;
    level.bases = bases;  // one for all, as before
  }
  return result;
}

Result<void> write_fabric(const std::string& path, const Fabric& fabric, const FabricWriteOptions& options) {
  const auto named = [&](Error error) {
    error.file = path;
    return tl::unexpected(std::move(error));
  };
  if (auto ok = validate(fabric); !ok) return named(ok.error());
  const LayerShape shape = shape_of(fabric);

  FabricHeader header = header_of(fabric);
  std::vector<ExrPart> parts{preview_part(fabric, options)};
  std::vector<Layer> layers;
  for (const Layer layer : all_layers) {
    bool stored = false;
    for (int k = 0; k < header.levels; ++k) stored = stored || is_stored(fabric, layer, k);
    if (!stored) continue;
    const std::size_t channels = channel_count(layer, shape);
    if (channels > static_cast<std::size_t>(ExrLimits{}.channels)) {
      return named(Error{Code::fabric_malformed,
                         {},
                         name_of(layer),
                         fmt::format("{} channels; a part has {} at most", channels, ExrLimits{}.channels)});
    }
    layers.push_back(layer);
    parts.push_back(data_part(fabric, layer, shape, options));
    header.layer(layer) = entry_for(fabric, layer, shape, parts.back());
  }
  const std::string text = text_of(header);
  const std::string digest = header_digest(text, parts);
  auto& attributes = parts.front().attributes;
  attributes[names::attribute_fabric] = text;
  attributes[names::attribute_digest] = digest;
  attributes.merge(mirrors_of(header));

  auto writer = ExrWriter::create(path, parts);
  if (!writer) return tl::unexpected(writer.error());
  // The preview does not depend on digits that the file does not hold.
  const FabricLevel base = as_stored(fabric.levels.front(), shape, options.half);
  if (auto ok = writer->write_level(0, 0, preview_of(base, fabric)); !ok) return ok;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    for (int k = 0; k < parts[i + 1].levels; ++k) {
      const ExrPixels pixels = pixels_at(fabric, layers[i], shape, k);
      if (auto ok = writer->write_level(static_cast<int>(i) + 1, k, pixels); !ok) return ok;
    }
  }
  return writer->commit();
}

}  // namespace selvedge
