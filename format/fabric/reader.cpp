#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "format/base/digest.h"
#include "format/fabric/file.h"
#include "format/fabric/level_values.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

/// Indices of the wanted channels in the part; -1 for missing ones.
std::vector<int> channel_indices(const ExrPart& part, const std::vector<std::string>& wanted) {
  std::map<std::string, int> index;
  for (std::size_t i = 0; i < part.channels.size(); ++i) index[part.channels[i].name] = static_cast<int>(i);
  std::vector<int> result;
  for (const std::string& name : wanted) {
    const auto found = index.find(name);
    result.push_back(found == index.end() ? -1 : found->second);
  }
  return result;
}

void check_size(const ExrPart& part, const FabricHeader& header, IssueSink& sink) {
  if (part.width != header.width || part.height != header.height)
    sink.add(Code::fabric_part, part.name, "the data window is not the texels of level 0");
}

/// The rules on the part of a layer of the header.
void check_layer_part(const ExrReader& file, const FabricHeader& header, LayerKind kind, IssueSink& sink) {
  const std::string name = part_name(kind, header.side);
  const int index = file.find_part(name);
  if (index < 0) return sink.add(Code::fabric_part, name, "the part is missing");
  const ExrPart& part = file.parts()[index];
  check_size(part, header, sink);
  if (!part.has_mipmaps) sink.add(Code::fabric_part, name, "is not tiled with mip levels");
  if (!fits_exr_part(kind, header.shape))
    return sink.add(Code::fabric_channel, name,
                    fmt::format("{} channels are needed; a part has {} at most",
                                channel_count(kind, header.shape), ExrLimits{}.channels));
  const std::vector<std::string> wanted = channel_names(kind, header.shape);
  const std::vector<int> indices = channel_indices(part, wanted);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (indices[i] >= 0) continue;
    sink.add(Code::fabric_channel, fmt::format("{}/{}", name, wanted[i]), "the channel is missing");
  }
}

/// Sets a layer of the level from its pixels; checks digest and values.
void decode_layer(const ExrPart& part, const ExrPixels& pixels, const FabricHeader& header, LayerKind kind,
                  int level_index, FabricLevel& level, IssueSink& sink) {
  const int entry = header.index_in_layer(kind, level_index);
  if (header.layer(kind)->digests[entry] != digest_of(part, pixels))
    sink.add(Code::fabric_digest, fmt::format("{}/level {}", part.name, level_index),
             "the pixels do not match the stored digest");
  std::vector<const std::vector<float>*> planes;
  for (const int index : channel_indices(part, channel_names(kind, header.shape)))
    planes.push_back(&pixels.planes[index]);
  if (kind == LayerKind::products) level.pairs = header.layer(kind)->pairs[entry];
  set_layer_pixels(level, kind, header.shape, planes);
  check_values(level, level_index, kind, header.shape, sink);
}

Result<FabricReader> first_error_of(Result<ExrReader> file, const FabricLimits& limits) {
  if (!file) return tl::unexpected(file.error());
  IssueSink sink(file->path());
  auto reader = FabricReader::open(std::move(*file), limits, sink);
  if (!reader) return tl::unexpected(sink.first_error());
  return std::move(*reader);
}

}  // namespace

std::string header_digest(const std::string& text, const std::vector<ExrPart>& parts) {
  std::string all = text;
  for (const ExrPart& part : parts) {
    all += '\n' + part.name;
    std::vector<std::string> channels;
    for (const ExrChannel& c : part.channels) channels.push_back(c.name + (c.is_half ? " half" : " float"));
    std::ranges::sort(channels);
    for (const std::string& c : channels) all += '\n' + c;
  }
  return digest_of(all);
}

const std::string* fabric_header_text(const std::vector<ExrPart>& parts) {
  if (parts.empty()) return nullptr;
  const auto found = parts.front().attributes.find(names::attribute_fabric);
  return found == parts.front().attributes.end() ? nullptr : &found->second;
}

ExrLimits exr_limits(const FabricLimits& limits) {
  return {.bytes_per_read = std::min(ExrLimits{}.bytes_per_read, limits.memory)};
}

std::optional<FabricReader> FabricReader::open(ExrReader file, const FabricLimits& limits, IssueSink& sink) {
  const std::string* text = fabric_header_text(file.parts());
  if (text == nullptr) {
    sink.add(Code::fabric_malformed, names::attribute_fabric, "attribute is missing: not a fabric file");
    return std::nullopt;
  }
  auto header = header_from_json(*text, limits, sink);
  if (sink.has_error()) return std::nullopt;
  const auto& first = file.parts().front();
  const auto digest = first.attributes.find(names::attribute_digest);
  if (digest == first.attributes.end() || digest->second != header_digest(*text, file.parts()))
    sink.add(Code::fabric_digest, names::attribute_digest,
             "does not match the attributes, part and channel names");
  if (first.name == names::part_preview && !first.has_mipmaps)
    check_size(first, *header, sink);
  else
    sink.add(Code::fabric_part, names::part_preview, "the first part is not a preview in scanlines");
  for_each_side(*header, [&](const FabricHeader& side) {
    for (const LayerKind kind : all_layers)
      if (side.layer(kind)) check_layer_part(file, side, kind, sink);
  });
  if (sink.has_error()) return std::nullopt;
  return FabricReader(std::move(file), std::move(*header), limits.memory);
}

Result<FabricReader> FabricReader::open(const std::string& path, const FabricLimits& limits) {
  return first_error_of(ExrReader::open(path, exr_limits(limits)), limits);
}

Result<FabricReader> FabricReader::open(std::span<const std::uint8_t> bytes, const std::string& name,
                                        const FabricLimits& limits) {
  return first_error_of(ExrReader::open(bytes, name, exr_limits(limits)), limits);
}

std::uint64_t FabricReader::peak_memory_bytes() const {
  std::uint64_t kept = 0;
  std::uint64_t largest = 0;
  for_each_side(header_, [&](const FabricHeader& side) {
    for (const LayerKind kind : all_layers) {
      const int part = file_.find_part(part_name(kind, side.side));
      // Numbers that belong to no texel are put in order; light that comes through has a copy of the opacity.
      const bool spread = kind == LayerKind::bases || kind == LayerKind::yarns ||
                          kind == LayerKind::indirect || kind == LayerKind::map;
      const std::uint64_t copies = spread ? 3 : kind == LayerKind::opacity ? 2 : 1;
      for (int k = 0; part >= 0 && k < header_.levels; ++k) {
        if (!side.has(kind, spread ? k : side.texel_level(k))) continue;
        const ExrPart& stored = file_.parts()[part];
        const std::uint64_t bytes = std::uint64_t{sizeof(float)} * stored.channels.size() *
                                    level_size(stored.width, k) * level_size(stored.height, k);
        kept += copies * bytes;
        largest = std::max(largest, bytes);
      }
    }
  });
  return kept + 2 * largest;
}

std::uint64_t FabricReader::packed_bytes(LayerKind kind, int level, Side side) const {
  const FabricHeader* const header = header_.find_side(side);
  if (header == nullptr || !header->has(kind, level)) return 0;
  return file_.packed_bytes(file_.find_part(part_name(kind, side)), level);
}

bool FabricReader::is_half(LayerKind kind, Side side) const {
  const int part = file_.find_part(part_name(kind, side));
  return part >= 0 && std::ranges::any_of(file_.parts()[part].channels, &ExrChannel::is_half);
}

/// The levels' own layers, and the bases.
Fabric FabricReader::read_side(const FabricHeader& side, IssueSink& sink) {
  Fabric fabric{side, {}, {}};
  for (int k = 0; k < side.levels; ++k) {
    FabricLevel& level = fabric.levels.emplace_back();
    level.width = level_size(side.width, k);
    level.height = level_size(side.height, k);
    for (const LayerKind kind : all_layers) {
      if (!side.has(kind, k)) continue;
      const int part = file_.find_part(part_name(kind, side.side));
      const auto pixels = file_.read_level(part, k);
      if (pixels)
        decode_layer(file_.parts()[part], *pixels, side, kind, k, level, sink);
      else
        sink.add(pixels.error());
    }
  }
  const std::shared_ptr<const ProductBases> bases = fabric.levels.front().bases;
  for (FabricLevel& level : fabric.levels) level.bases = level.has(LayerKind::products) ? bases : nullptr;
  return fabric;
}

std::optional<Fabric> FabricReader::read(IssueSink& sink) {
  if (peak_memory_bytes() > memory_) {
    sink.add(memory_limit_error(path(), "", "the values of the fabric", memory_));
    return std::nullopt;
  }
  Fabric fabric = read_side(header_, sink);
  std::vector<Fabric> others;
  for (const FabricHeader& side : header_.sides) others.push_back(read_side(side, sink));
  if (sink.has_error()) return std::nullopt;
  if (header_.layer(LayerKind::yarns))
    restore_yarns(fabric.levels.front(), header_.shape, header_.period_mm, memory_ - peak_memory_bytes(),
                  sink);
  if (sink.has_error()) return std::nullopt;
  for (std::size_t s = 0; s < others.size(); ++s) {
    restore_light_through(fabric.levels.front(), others[s].levels.front());
    for (int k = 0; k < header_.levels; ++k) {
      const int shown = header_.sides[s].texel_level(k);
      if (shown > k) others[s].levels[k].copy_texels(others[s].levels[shown], shown - k);
    }
    fabric.add_side(std::move(others[s]));
  }
  return fabric;
}

Result<Fabric> FabricReader::read() {
  IssueSink sink(path());
  auto fabric = read(sink);
  if (!fabric) return tl::unexpected(sink.first_error());
  return std::move(*fabric);
}

Result<Fabric> read_fabric(const std::string& path, const FabricLimits& limits) {
  return FabricReader::open(path, limits).and_then([](FabricReader reader) { return reader.read(); });
}

Result<Fabric> read_fabric(std::span<const std::uint8_t> bytes, const std::string& name,
                           const FabricLimits& limits) {
  return FabricReader::open(bytes, name, limits).and_then([](FabricReader reader) { return reader.read(); });
}

}  // namespace selvedge
