#include "format/fabric/header_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "format/base/json_text.h"
#include "format/fabric/json_member.h"
#include "format/fabric/json_parts.h"
#include "format/fabric/layers_json.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

using nlohmann::json;
namespace member = names::member;

/// Whether a layer of the file uses the grid of lights.
bool has_lights(const FabricHeader& header) {
  return header.layer(LayerKind::light).has_value() || header.layer(LayerKind::bases).has_value();
}

/// The whole fabric of a file with `levels` levels (0: invalid), the first of which has `texels`.
std::optional<WholeFabric> whole_from(const Member& text, const V2i& texels, int levels,
                                      const FabricLimits& limits) {
  text.warn_of_unknown_members({member::level, member::levels, member::texels});
  const auto size = text.require_pair(member::texels);
  const auto width = size[0].whole_number(1, limits.texels_per_side);
  const auto height = size[1].whole_number(1, limits.texels_per_side);
  const Member level = text.require(member::level);
  if (!width || !height) return std::nullopt;
  const int all = level_count(*width, *height);
  const auto number = level.whole_number(0, all - 1);
  if (!number) return std::nullopt;
  WholeFabric whole{V2i(*width, *height), *number};
  if (!is_level_of(whole, texels.x, texels.y)) {
    text.refuse(fmt::format("level {} of {}x{} texels does not have {}x{}", *number, *width, *height,
                            texels.x, texels.y));
    return std::nullopt;
  }
  if (text.has(member::levels)) {
    const auto count = text.require(member::levels).whole_number(*number + levels, all);
    if (!count) return std::nullopt;
    whole.levels = *count;
  }
  if (levels == 0 || has_more_levels(whole, levels)) return whole;
  level.refuse("is 0, and no coarser level is missing");
  return std::nullopt;
}

/// Sets the counts of the shape that depend on several members.
void complete_shape(FabricHeader& header) {
  LayerShape& shape = header.shape;
  shape.views = header.views.count();
  shape.lights = header.lights.count();
  shape.base_texels = header.width * header.height;
  const auto& products = header.layer(LayerKind::products);
  if (!products) return;
  for (const auto& pairs : products->pairs) {
    shape.products = std::max(shape.products, static_cast<int>(pairs.size()));
  }
}

}  // namespace

namespace {

/// The members that every side has of its own.
json side_json(const FabricHeader& header) {
  json text = {{member::views, grid_json(header.views)},
               {member::provenance, provenance_json(header.provenance)}};
  write_layers(header, text);
  if (has_lights(header)) text[member::lights] = grid_json(header.lights);
  if (header.radiance_scale != 1) text[member::radiance_scale] = header.radiance_scale;
  return text;
}

/// Reads the members that every side has of its own. False if nothing can be read without them.
bool read_side(const Member& text, FabricHeader& header, const FabricLimits& limits) {
  if (text.has(member::radiance_scale)) {
    header.radiance_scale = text.require(member::radiance_scale).real_number(true).value_or(1);
  }
  if (const Member provenance = text.require_object(member::provenance)) {
    header.provenance = provenance.value->dump();
  }
  const auto views = grid_member(text.require(member::views), limits);
  if (!views) return false;
  header.views = *views;
  read_layers(text, header, limits);
  if (has_lights(header)) {
    const auto lights = grid_member(text.require(member::lights), limits);
    if (!lights) return false;
    header.lights = *lights;
  }
  check_bases(header, text);
  return true;
}

/// Adds a side of the front's texels and levels to its header.
void read_other_side(const Member& text, Side side, FabricHeader& front, const FabricLimits& limits) {
  text.warn_of_unknown_members({member::radiance_scale, member::views, member::lights, member::layers,
                                member::digests, member::provenance});
  FabricHeader header = front;
  header.sides.clear();
  header.layers = {};
  header.shape = {.side = side, .yarns = front.shape.yarns};
  header.side = side;
  header.radiance_scale = 1;
  if (!read_side(text, header, limits)) return;
  const FabricHeader* const seen = front.side_of(side == Side::back_through ? Side::back : Side::front);
  if (seen == nullptr || (lets_through(side) && header.views != seen->views)) {
    return text.refuse("the views are not those of the side that is seen");
  }
  require_layer(header, LayerKind::indirect, front, LayerKind::yarns, text);
  for (int k = 0; k < header.levels; ++k) {
    const int shown = header.level_of_texels(k);
    if (shown == k) continue;
    if (shown < 0) return text.refuse(fmt::format("level {} has no layer of it, nor has a coarser one", k));
    if (header.has(LayerKind::frame, k) || header.has(LayerKind::opacity, k))
      return text.refuse(fmt::format("level {} has a layer of it, but no reflectance", k));
  }
  complete_shape(header);
  front.sides.push_back(std::move(header));
}

}  // namespace

std::string header_to_json(const FabricHeader& header) {
  json text = side_json(header);
  text[member::version] = {names::fabric_version_major, minor_version(header)};
  text[member::model] = header.model;
  text[member::texels] = {header.width, header.height};
  text[member::levels] = header.levels;
  text[member::mm_per_repeat] = {header.period_mm.x, header.period_mm.y};
  text[member::reference_height] = header.reference_height;
  text[member::thickness] = header.thickness_mm;
  for (const FabricHeader& other : header.sides) text[member::sides][name_of(other.side)] = side_json(other);
  if (header.whole) text[member::whole] = whole_json(*header.whole);
  return text.dump();
}

std::optional<json> parse_fabric_text(const std::string& text, IssueSink& sink) {
  json parsed = parse_json(text);
  if (!parsed.is_object()) {
    sink.add(Code::fabric_malformed, names::attribute_fabric, "is not a JSON object");
    return std::nullopt;
  }
  const auto version = Member{&parsed, {}, &sink}.require_pair(member::version);
  if (!version[0]) return std::nullopt;
  if (!version[0].value->is_number_integer()) {
    version[0].refuse("is not a whole number");
    return std::nullopt;
  }
  if (*version[0].value != names::fabric_version_major) {
    sink.add(Code::fabric_version, "/version",
             fmt::format("version {} is not understood; this program reads version {}",
                         parsed[member::version].dump(), names::fabric_version_major));
    return std::nullopt;
  }
  if (!version[1].whole_number(0, std::numeric_limits<int>::max())) return std::nullopt;
  return parsed;
}

std::optional<FabricHeader> header_from_json(const json& members, const FabricLimits& limits,
                                             IssueSink& sink) {
  FabricHeader header;
  const Member text{&members, {}, &sink};
  const json& minor = members[member::version][1];
  if (minor > names::fabric_version_minor) {
    sink.add(Code::fabric_advice, "/version/1",
             fmt::format("minor version {}; what it may have added is not known", minor.dump()));
  }
  text.warn_of_unknown_members({member::version, member::model, member::texels, member::levels,
                                member::mm_per_repeat, member::reference_height, member::thickness,
                                member::radiance_scale, member::views, member::lights, member::layers,
                                member::digests, member::provenance, member::whole, member::sides});
  const auto model = members.find(member::model);
  if (model == members.end() || !model->is_string()) {
    sink.add(Code::fabric_advice, "/model", "is missing or not a string");
  } else {
    header.model = model->get<std::string>();
  }
  const auto texels = text.require_pair(member::texels);
  const auto width = texels[0].whole_number(1, limits.texels_per_side);
  const auto height = texels[1].whole_number(1, limits.texels_per_side);
  const auto period = text.require_pair(member::mm_per_repeat);
  header.period_mm.x = period[0].real_number(true).value_or(1);
  header.period_mm.y = period[1].real_number(true).value_or(1);
  header.reference_height = text.require(member::reference_height).real_number().value_or(0);
  const Member thickness = text.require(member::thickness);
  header.thickness_mm = thickness.real_number().value_or(0);
  if (header.thickness_mm < 0) thickness.refuse("is negative");
  const Member levels = text.require(member::levels);
  const int count = width && height ? levels.whole_number(1, level_count(*width, *height)).value_or(0) : 0;
  if (text.has(member::whole) && width && height) {
    if (const Member whole = text.require_object(member::whole)) {
      header.whole = whole_from(whole, V2i(*width, *height), count, limits);
    }
  }
  if (count == 0) return std::nullopt;
  header.width = *width;
  header.height = *height;
  header.levels = count;
  if (!read_side(text, header, limits)) return std::nullopt;
  require_layer(header, LayerKind::yarns, header, LayerKind::indirect, text);
  require_layer(header, LayerKind::indirect, header, LayerKind::yarns, text);
  complete_shape(header);
  if (text.has(member::sides)) {
    const Member sides = text.require_object(member::sides);
    for (const Side side : other_sides) {
      if (!sides || !sides.has(name_of(side))) continue;
      if (const Member other = sides.require_object(name_of(side))) {
        read_other_side(other, side, header, limits);
      }
    }
    if (sides) sides.warn_of_unknown_members({"back", "through", "back.through"});
  }
  return header;
}

}  // namespace selvedge
