#include "format/check/fabric_extras.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "format/fabric/names.h"
#include "format/fabric/rules.h"

namespace selvedge {
namespace {

/// The JSON pointer of a side.
std::string pointer_of(const FabricHeader& header) {
  return header.side == Side::front ? "" : fmt::format("/{}/{}", names::member::sides, name_of(header.side));
}

void check_channel_names(const std::vector<ExrPart>& parts, IssueSink& sink) {
  std::set<std::string> seen;
  for (const ExrPart& part : parts) {
    for (const ExrChannel& channel : part.channels) {
      const std::string place = fmt::format("{}/{}", part.name, channel.name);
      if (!seen.insert(channel.name).second) {
        sink.add(Code::fabric_channel, place, "another part has a channel of that name");
      }
      const char last = channel.name.empty() ? ' ' : channel.name.back();
      const auto& endings = names::colour_endings;
      if (part.name != names::part_preview &&
          std::find(endings.begin(), endings.end(), last) != endings.end()) {
        sink.add(Code::fabric_channel, place,
                 fmt::format("ends in {}: tools change such channels as colours", last));
      }
    }
  }
}

/// Checks that all channels are known and have the precision of the attribute text.
void check_layer_channels(const ExrPart& part, const FabricHeader& header, LayerKind layer, IssueSink& sink) {
  const std::vector<std::string> names = channel_names(layer, header.shape);
  const std::set<std::string> known(names.begin(), names.end());
  const bool half = header.layer(layer)->half;
  bool differs = false;
  for (const ExrChannel& channel : part.channels) {
    differs = differs || channel.half != half;
    if (known.contains(channel.name)) continue;
    sink.add(Code::fabric_advice, fmt::format("{}/{}", part.name, channel.name),
             "the channel is not known and is ignored");
  }
  if (differs) {
    sink.add(Code::fabric_advice, fmt::format("{}/layers/{}/precision", pointer_of(header), name_of(layer)),
             "the part's channels are not all of that precision");
  }
}

void check_preview(const ExrPart& part, const FabricHeader& header, IssueSink& sink) {
  check_windows(part, header, sink);
  if (is_lossy(part.compression)) {
    sink.add(Code::fabric_advice, part.name,
             fmt::format("compression '{}' is lossy; the pixels were not checked", part.compression));
  }
  if (part.tiled) sink.add(Code::fabric_advice, part.name, "is tiled: some viewers read scanlines only");
  for (const char* name : names::preview_channels) {
    if (std::none_of(part.channels.begin(), part.channels.end(),
                     [&](const ExrChannel& channel) { return channel.name == name; })) {
      sink.add(Code::fabric_advice, fmt::format("{}/{}", part.name, name), "the preview has no such channel");
    }
  }
}

void check_mirrors(const ExrPart& first, const FabricHeader& header, IssueSink& sink) {
  for (const auto& [name, value] : mirrors_of(header)) {
    const auto found = first.attributes.find(name);
    if (found == first.attributes.end() || found->second != value) {
      sink.add(Code::fabric_advice, name, "the mirror is missing or differs from the attribute text");
    }
  }
}

/// Warns of layers that some levels lack.
void check_layer_levels(const FabricHeader& header, IssueSink& sink) {
  // A level with products needs no tables; the fit chooses between them.
  for (const LayerKind layer :
       {LayerKind::lobes, LayerKind::frame, LayerKind::table, LayerKind::opacity, LayerKind::light}) {
    if (!header.layer(layer)) continue;
    int without = 0;
    for (int k = 0; k < header.levels; ++k) {
      const bool left_out = header.level_of_texels(k) != k;
      if (!left_out && !header.has(layer, k) && !header.has(LayerKind::products, k)) ++without;
    }
    if (without == 0) continue;
    sink.add(Code::fabric_levels, fmt::format("{}/layers/{}/levels", pointer_of(header), name_of(layer)),
             fmt::format("{} of the {} levels: on the others the layer counts as 1", header.levels - without,
                         header.levels));
  }
}

void check_levels(const FabricHeader& header, IssueSink& sink) {
  const int complete = level_count(header.width, header.height);
  if (header.levels < complete && whole_levels(header) == header.first_level() + header.levels) {
    sink.add(Code::fabric_levels, "/levels",
             fmt::format("{} of {}: the chain stops before 1x1", header.levels, complete));
  }
  if (const std::string missing = missing_levels(header); !missing.empty())
    sink.add(Code::fabric_levels, "/whole", missing);
  for_each_side(header, [&](const FabricHeader& side) { check_layer_levels(side, sink); });
}

}  // namespace

void check_extras(const ExrReader& file, const FabricHeader& header, IssueSink& sink) {
  const auto& parts = file.parts();
  check_mirrors(parts.front(), header, sink);
  if (file.find_part(names::part_preview) < 0) {
    sink.add(Code::fabric_part, names::part_preview, "the part is missing");
  } else if (parts.front().name != names::part_preview) {
    sink.add(Code::fabric_advice, parts.front().name, "the first part is not the preview");
  }
  check_channel_names(parts, sink);
  for (const ExrPart& part : parts) {
    const auto wrap = part.attributes.find(names::attribute_wrap);
    if (wrap == part.attributes.end() || wrap->second != ExrValue(std::string(names::wrap_periodic))) {
      sink.add(Code::fabric_advice, fmt::format("{}/{}", part.name, names::attribute_wrap),
               fmt::format("is not {}: tools will not repeat the pictures", names::wrap_periodic));
    }
    const auto layer = layer_of_part(part.name);
    const FabricHeader* const side = layer ? header.side_of(layer->side) : nullptr;
    if (part.name == names::part_preview) {
      check_preview(part, header, sink);
    } else if (side != nullptr && side->layer(layer->kind)) {
      if (!fits_a_part(layer->kind, side->shape)) continue;
      check_layer_channels(part, *side, layer->kind, sink);
    } else {
      check_windows(part, header, sink);
      sink.add(Code::fabric_advice, part.name, "the part is of no known layer and is ignored");
    }
  }
  check_levels(header, sink);
}

}  // namespace selvedge
