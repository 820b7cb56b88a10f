#include <Imath/half.h>
#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "format/fabric/evaluate.h"
#include "format/fabric/file.h"
#include "format/fabric/level_values.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

/// Whether the file has the layer at a level; the bases are at level 0.
bool is_stored(const Fabric& fabric, LayerKind kind, int k) {
  if (!side_layers(fabric.side).contains(kind)) return false;
  // The last level of a file has no coarser one.
  const bool left_out =
      fabric.levels[k].copied_from_coarser && k + 1 < static_cast<int>(fabric.levels.size());
  if (left_out && kind != LayerKind::bases && kind != LayerKind::indirect) return false;
  return kind == LayerKind::bases ? k == 0 && shared_bases(fabric) != nullptr : fabric.levels[k].has(kind);
}

ExrPart new_part(const Fabric& fabric, const std::string& name) {
  ExrPart part{.name = name, .width = fabric.texels().x, .height = fabric.texels().y};
  part.attributes[names::attribute_wrap] = names::wrap_periodic;
  return part;
}

ExrPart data_part(const Fabric& fabric, LayerKind kind, const LayerShape& shape,
                  const FabricWriteOptions& options) {
  ExrPart part = new_part(fabric, part_name(kind, shape.side));
  part.has_mipmaps = true;
  part.levels = level_count(part.width, part.height);
  for (const std::string& channel : channel_names(kind, shape))
    part.channels.push_back({channel, options.half_layers.contains(kind)});
  return part;
}

void round_to_half(std::span<float> values) {
  for (float& value : values) value = Imath::half(value);
}

/// A level with its own layers of `half` rounded to 16 bits.
FabricLevel as_stored(FabricLevel level, const LayerSet& half) {
  for (const LayerKind kind : all_layers) {
    if (!half.contains(kind)) continue;
    Layer layer = level[kind];
    round_to_half(layer.values);
    level.set_layer(kind, std::move(layer));
  }
  if (level.yarns() && half.contains(LayerKind::indirect) && level.yarns()->data().packing.step == 0) {
    const YarnData& before = level.yarns()->data();
    YarnData data = before;
    round_to_half(data.station_light);
    round_to_half(data.light_through);
    // Yarns take long to build.
    if (data.station_light != before.station_light || data.light_through != before.light_through)
      level.set_yarns(std::make_shared<const Yarns>(std::move(data), level.yarns()->period()));
  }
  return level;
}

/// The preview for EXR viewers: level 0 seen along the normal under a white light from the upper left,
/// premultiplied, with an exposure for which white Lambertian cloth that faces the light is 1.
ExrPixels preview_of(const FabricLevel& level, const FabricInfo& info) {
  ExrPixels pixels{level.width, level.height, std::vector<std::vector<float>>(4)};
  const V3f light = V3f(-0.4F, 0.5F, 0.8F).normalized();
  for (int y = 0; y < level.height; ++y) {
    for (int x = 0; x < level.width; ++x) {
      const Shading s = evaluate(level, info, x, y, light, {0, 0, 1});
      const V3f colour = s.radiance * (s.alpha * std::numbers::pi_v<float>);
      for (int c = 0; c < 3; ++c) pixels.planes[c].push_back(std::min(colour[c], 1000.0F));
      pixels.planes[3].push_back(s.alpha);
    }
  }
  return pixels;
}

/// The pixels of a level of the part, zeros if the fabric does not have the level or layer.
ExrPixels pixels_at(const Fabric& fabric, LayerKind kind, const LayerShape& shape, int level) {
  const bool bases = kind == LayerKind::bases;
  if (!bases && level < static_cast<int>(fabric.levels.size()) && is_stored(fabric, kind, level))
    return layer_pixels(fabric.levels[level], kind, shape);
  FabricLevel stored;
  stored.width = level_size(fabric.texels().x, level);
  stored.height = level_size(fabric.texels().y, level);
  if (bases && level == 0) stored.bases = shared_bases(fabric);
  return layer_pixels(stored, kind, shape);
}

/// A layer of a side, which is a part of the file.
struct SideLayer {
  const Fabric* side;
  LayerKind kind;
  LayerShape shape;
};

/// The header of a side, whose parts and layers are appended. `yarns`: of the front.
Result<FabricHeader> add_side(const Fabric& side, const YarnCounts& yarns, const FabricWriteOptions& options,
                              std::vector<ExrPart>& parts, std::vector<SideLayer>& layers) {
  FabricHeader header = header_without_layers(side);
  header.shape.yarns = yarns;
  const LayerShape& shape = header.shape;
  FabricLevel bases;
  bases.width = header.width;
  bases.height = header.height;
  bases.bases = shared_bases(side);
  for (const LayerKind kind : all_layers) {
    std::vector<int> stored;  // levels
    for (int k = 0; k < header.levels; ++k)
      if (is_stored(side, kind, k)) stored.push_back(k);
    if (stored.empty()) continue;
    if (!fits_exr_part(kind, shape))
      return fail(Code::fabric_malformed, {}, part_name(kind, side.side),
                  fmt::format("{} channels; a part has {} at most", channel_count(kind, shape),
                              ExrLimits{}.channels));
    // Values that a reader would refuse are refused, such as the NaN of a fit.
    IssueSink sink({});
    for (const int k : stored)
      check_values(kind == LayerKind::bases ? bases : side.levels[k], k, kind, shape, sink);
    if (sink.has_error()) return tl::unexpected(sink.first_error());
    layers.push_back({&side, kind, shape});
    parts.push_back(data_part(side, kind, shape, options));
    LayerHeader& entry = header.layer(kind).emplace();
    entry.levels = stored;
    for (const int k : stored) {
      entry.digests.push_back(digest_of(parts.back(), pixels_at(side, kind, shape, k)));
      if (kind == LayerKind::products) entry.pairs.push_back(side.levels[k].pairs);
    }
  }
  return header;
}

/// The parts that are written: the preview, and one for each layer of each side.
struct FabricParts {
  std::vector<ExrPart> parts;
  std::vector<SideLayer> layers;
  /// The preview is computed from rounded values, so that it is the same after reading and writing again.
  ExrPixels preview;

  /// `path` is used in messages; the fabric must outlive the result.
  static Result<FabricParts> plan(const std::string& path, const Fabric& fabric,
                                  const FabricWriteOptions& options) {
    const auto failed = [&](Error error) {
      error.file = path;
      return tl::unexpected(std::move(error));
    };
    if (const auto& yarns = fabric.levels.front().yarns()) {
      const YarnMap& map = yarns->data().map;
      if (auto ok = validate(yarns->data(), map.yarn_period(fabric.period_mm)); !ok)
        return failed(ok.error());
      if (!map.empty() && map.kinds != fabric.texels())
        return failed(Error{Code::fabric_malformed, {}, "map", "does not have one texel for each stitch"});
    }
    FabricHeader header;
    FabricParts result{{new_part(fabric, names::part_preview)}, {}, {}};
    for (const char* channel : names::preview_channels) result.parts[0].channels.push_back({channel});
    for (const Side side : all_sides) {
      const Fabric* const sided = side == Side::front ? &fabric : fabric.find_side(side);
      if (sided == nullptr) continue;
      auto added = add_side(*sided, layer_shape_of(fabric).yarns, options, result.parts, result.layers);
      if (!added) return failed(added.error());
      if (side == Side::front)
        header = std::move(*added);
      else
        header.sides.push_back(std::move(*added));
    }
    if (result.layers.empty()) return fail(Code::fabric_malformed, path, "layers", "the fabric has no layer");
    const std::string text = header_to_json(header);
    const std::string digest = header_digest(text, result.parts);
    auto& attributes = result.parts.front().attributes;
    attributes[names::attribute_fabric] = text;
    attributes[names::attribute_digest] = digest;
    FabricLevel texels = fabric.levels.front();
    texels.set_yarns(nullptr);
    result.preview = preview_of(as_stored(std::move(texels), options.half_layers), fabric);
    return result;
  }
  ExrPixels pixels(int part, int level) const {
    if (part == 0) return preview;
    const auto& [side, kind, shape] = layers[part - 1];
    return pixels_at(*side, kind, shape, level);
  }
};

}  // namespace

Fabric round_to_stored_precision(const Fabric& fabric, const LayerSet& half) {
  Fabric result = fabric;
  for (FabricLevel& level : result.levels) level = as_stored(std::move(level), half);
  for (auto& other : result.sides)
    if (other) other = std::make_shared<const Fabric>(round_to_stored_precision(*other, half));
  if (!half.contains(LayerKind::bases) || !shared_bases(fabric)) return result;
  ProductBases rounded = *shared_bases(fabric);
  round_to_half(rounded.view);
  for (V3f& psi : rounded.light) round_to_half({&psi.x, 3});
  const auto bases = std::make_shared<const ProductBases>(std::move(rounded));
  for (FabricLevel& level : result.levels)
    if (level.bases) level.bases = bases;
  return result;
}

Result<std::uint64_t> fabric_file_bytes(const Fabric& fabric, const FabricWriteOptions& options) {
  const auto planned = FabricParts::plan({}, fabric, options);
  if (!planned) return tl::unexpected(planned.error());
  return exr_file(planned->parts, [&](int part, int level) { return planned->pixels(part, level); }).size();
}

Result<void> write_fabric(const std::string& path, const Fabric& fabric, const FabricWriteOptions& options) {
  const auto planned = FabricParts::plan(path, fabric, options);
  if (!planned) return tl::unexpected(planned.error());
  return write_exr_file(path, planned->parts,
                        [&](int part, int level) { return planned->pixels(part, level); });
}

}  // namespace selvedge
