#include "format/fabric/rules.h"

#include <fmt/format.h>

#include <algorithm>

#include "format/base/digest.h"
#include "format/base/mip.h"
#include "format/fabric/header_json.h"
#include "format/fabric/level_values.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

/// Indices of the wanted channels in the part; -1 for missing ones.
std::vector<int> channel_indices(const ExrPart& part, const std::vector<std::string>& wanted) {
  std::map<std::string, int> index;
  for (std::size_t i = 0; i < part.channels.size(); ++i) {
    index[part.channels[i].name] = static_cast<int>(i);
  }
  std::vector<int> result;
  for (const std::string& name : wanted) {
    const auto found = index.find(name);
    result.push_back(found == index.end() ? -1 : found->second);
  }
  return result;
}

}  // namespace

std::string header_digest(const std::string& text, const std::vector<ExrPart>& parts) {
  std::string all = text;
  for (const ExrPart& part : parts) {
    all += '\n' + part.name;
    std::vector<std::string> channels;
    for (const ExrChannel& c : part.channels) {
      channels.push_back(c.name + ' ' + (c.half ? names::precision_half : names::precision_float));
    }
    std::sort(channels.begin(), channels.end());
    for (const std::string& c : channels) all += '\n' + c;
  }
  return digest_of(all);
}

std::map<std::string, ExrValue> mirrors_of(const FabricHeader& header) {
  return {
      {names::attribute_version, fmt::format("{}.{}", names::fabric_version_major, minor_version(header))},
      {names::attribute_model, header.model},
      {names::attribute_period, header.period_mm},
      {names::attribute_reference_height, header.reference_height}};
}

const std::string* fabric_text(const std::vector<ExrPart>& parts) {
  if (parts.empty()) return nullptr;
  const auto found = parts.front().attributes.find(names::attribute_fabric);
  return found == parts.front().attributes.end() ? nullptr : std::get_if<std::string>(&found->second);
}

std::optional<FabricHeader> check_header(const ExrReader& file, const FabricLimits& limits, IssueSink& sink) {
  const std::string* text = fabric_text(file.parts());
  if (text == nullptr) {
    sink.add(Code::fabric_malformed, names::attribute_fabric, "attribute is missing: not a fabric file");
    return std::nullopt;
  }
  const auto members = parse_fabric_text(*text, sink);
  if (!members) return std::nullopt;
  const auto& attributes = file.parts().front().attributes;
  const auto digest = attributes.find(names::attribute_digest);
  if (digest == attributes.end() || digest->second != ExrValue(header_digest(*text, file.parts()))) {
    sink.add(Code::fabric_digest, names::attribute_digest,
             "does not match the attributes, part and channel names");
  }
  return header_from_json(*members, limits, sink);
}

void check_windows(const ExrPart& part, const FabricHeader& header, IssueSink& sink) {
  if (part.width != header.width || part.height != header.height) {
    sink.add(Code::fabric_part, part.name, "the data window is not the texels of level 0");
  }
  if (!part.display_is_data) sink.add(Code::fabric_part, part.name, "display window and data window differ");
}

void check_data_part(const ExrPart& part, const FabricHeader& header, IssueSink& sink) {
  check_windows(part, header, sink);
  if (!part.mipmapped) sink.add(Code::fabric_part, part.name, "is not tiled with mip levels");
  if (!part.increasing_y) sink.add(Code::fabric_part, part.name, "line order is not INCREASING_Y");
  if (is_lossy(part.compression)) {
    sink.add(Code::fabric_lossy, part.name, fmt::format("compression '{}' is lossy", part.compression));
  }
}

bool check_layer_part(const ExrReader& file, const FabricHeader& header, LayerKind kind, IssueSink& sink) {
  const std::size_t errors_before = sink.errors();
  const std::string name = part_name(kind, header.side);
  const auto& parts = file.parts();
  const auto count =
      std::count_if(parts.begin(), parts.end(), [&](const ExrPart& p) { return p.name == name; });
  if (count != 1) {
    sink.add(Code::fabric_part, name,
             count == 0 ? "the part is missing" : "more than one part has that name");
    return false;
  }
  const ExrPart& part = parts[file.find_part(name)];
  check_data_part(part, header, sink);
  if (!fits_a_part(kind, header.shape)) {
    sink.add(Code::fabric_channel, name,
             fmt::format("{} channels are needed; a part has {} at most", channel_count(kind, header.shape),
                         ExrLimits{}.channels));
    return false;
  }
  const std::vector<std::string> wanted = channel_names(kind, header.shape);
  const std::vector<int> indices = channel_indices(part, wanted);
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (indices[i] >= 0) continue;
    sink.add(Code::fabric_channel, fmt::format("{}/{}", name, wanted[i]), "the channel is missing");
  }
  return sink.errors() == errors_before;
}

ExrLimits exr_limits(const FabricLimits& limits) {
  return {.bytes_per_read = std::min(ExrLimits{}.bytes_per_read, limits.memory)};
}

std::uint64_t pixel_memory(const ExrPart& part, int level) {
  return std::uint64_t{sizeof(float)} * part.channels.size() * level_size(part.width, level) *
         level_size(part.height, level);
}

std::uint64_t memory_of_levels(const ExrReader& file, const FabricHeader& header, int first, int last,
                               const LayerSet& layers) {
  std::uint64_t kept = 0;
  std::uint64_t largest = 0;
  for_each_side(header, [&](const FabricHeader& side) {
    const auto add = [&](LayerKind kind, int level, std::uint64_t copies) {
      const int part = file.find_part(part_name(kind, side.side));
      const bool spread = kind == LayerKind::bases || kind == LayerKind::yarns || kind == LayerKind::indirect;
      if (part < 0 || !side.has(kind, spread ? level : side.level_of_texels(level))) return;
      const std::uint64_t bytes = pixel_memory(file.parts()[part], level);
      kept += copies * bytes;
      largest = std::max(largest, bytes);
    };
    for (const LayerKind kind : all_layers) {
      // Products of any level bring the bases. Numbers that belong to no texel are put in order. Light that
      // comes through has a copy of the opacity.
      const bool bases = kind == LayerKind::bases;
      const bool listed = bases || kind == LayerKind::yarns || kind == LayerKind::indirect;
      if (!layers.contains(bases ? LayerKind::products : kind)) continue;
      if (bases) add(kind, 0, 3);
      const std::uint64_t copies = listed ? 3 : kind == LayerKind::opacity ? 2 : 1;
      for (int k = first; k <= last && !bases; ++k) add(kind, k, copies);
    }
  });
  return kept + 2 * largest;
}

void decode_layer(const ExrPart& part, const ExrPixels& pixels, const FabricHeader& header, LayerKind kind,
                  int level_index, FabricLevel& level, IssueSink& sink) {
  const int entry = header.entry(kind, level_index);
  if (header.layer(kind)->digests[entry] != digest_of(part, pixels)) {
    sink.add(Code::fabric_digest, fmt::format("{}/level {}", part.name, level_index),
             "the pixels do not match the stored digest");
  }
  std::vector<const std::vector<float>*> planes;
  for (const int index : channel_indices(part, channel_names(kind, header.shape))) {
    planes.push_back(&pixels.planes[index]);
  }
  if (kind == LayerKind::products) level.pairs = header.layer(kind)->pairs[entry];
  set_pixels(level, kind, header.shape, planes);
  check_values(level, level_index, kind, header.shape, sink);
}

}  // namespace selvedge
