#include "format/fabric/header_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "format/base/json_text.h"
#include "format/fabric/json_member.h"
#include "format/fabric/json_parts.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

using nlohmann::json;
namespace member = names::member;

std::vector<int> levels_from(const Member& list, int levels) {
  std::vector<int> result;
  if (list && list.value->empty()) list.refuse("names no level");
  for (const Member& item : list.items()) {
    const auto level = item.whole_number(0, levels - 1);
    if (!level) return {};
    if (!result.empty() && *level <= result.back()) {
      item.refuse(fmt::format("{} does not come after {}", *level, result.back()));
      return {};
    }
    result.push_back(*level);
  }
  return result;
}

/// Whether the list has one item for each of the layer's levels.
bool has_items(const Member& list, std::size_t count) {
  if (list && list.value->size() != count) {
    list.refuse(fmt::format("has {} items, the layer {} levels", list.value->size(), count));
  }
  return list && list.value->size() == count;
}

std::vector<std::string> digests_from(const Member& list, std::size_t count) {
  std::vector<std::string> result;
  if (!has_items(list, count)) return result;
  for (const Member& item : list.items()) {
    if (!item.value->is_string()) {
      item.refuse("is not a string");
      return {};
    }
    result.push_back(item.value->get<std::string>());
  }
  return result;
}

/// The pairs of functions of each of the layer's levels.
std::vector<std::vector<V2i>> pairs_from(const Member& lists, std::size_t count, const FabricLimits& limits) {
  std::vector<std::vector<V2i>> result;
  if (!has_items(lists, count)) return result;
  for (const Member& list : lists.items()) {
    if (!list.value->is_array() || list.value->empty() ||
        std::cmp_greater(list.value->size(), limits.products)) {
      list.refuse(fmt::format("is not an array of 1 to {} pairs", limits.products));
      return result;
    }
    std::vector<V2i>& pairs = result.emplace_back();
    for (const Member& pair : list.items()) {
      if (!pair.value->is_array() || pair.value->size() != 2) {
        pair.refuse("is not a pair of whole numbers");
        return result;
      }
      const std::vector<Member> items = pair.items();
      const auto view = items[0].whole_number(0, limits.functions);
      const auto light = items[1].whole_number(0, limits.functions - 1);
      if (!view || !light) return result;
      pairs.emplace_back(*view, *light);
    }
  }
  return result;
}

/// Reads the members that only this kind of layer has.
void read_own_members(LayerKind kind, const Member& layer, const FabricLimits& limits, LayerHeader& result,
                      LayerShape& shape) {
  const auto number = [](const Member& object, const char* name, int min, int max) {
    return object.require(name).whole_number(min, max).value_or(min);
  };
  if (kind == LayerKind::lobes) shape.lobes = number(layer, member::lobes, 0, limits.lobes);
  if (kind == LayerKind::products) {
    result.pairs = pairs_from(layer.require_array(member::pairs), result.levels.size(), limits);
  }
  if (kind == LayerKind::yarns) {
    shape.yarns = {number(layer, member::curves, 1, limits.curves),
                   number(layer, member::nodes, 2, limits.nodes),
                   number(layer, member::stations, 1, limits.stations)};
  }
  constexpr LayerSet of_level_0{LayerKind::bases, LayerKind::yarns, LayerKind::indirect};
  if (of_level_0.contains(kind) && result.levels != std::vector{0}) {
    layer.sink->add(Code::fabric_member, pointer_to(layer.place, member::levels), "is not level 0 alone");
  }
  if (kind == LayerKind::bases) {
    const Member functions = layer.require_object(member::functions);
    shape.view_functions = number(functions, member::views, 0, limits.functions);
    shape.light_functions = number(functions, member::lights, 1, limits.functions);
  }
}

json own_members(LayerKind kind, const LayerHeader& layer, const LayerShape& shape) {
  switch (kind) {
    case LayerKind::lobes:
      return {{member::lobes, shape.lobes}};
    case LayerKind::products: {
      json lists = json::array();
      for (const auto& pairs : layer.pairs) {
        json& list = lists.emplace_back(json::array());
        for (const V2i& pair : pairs) list.push_back({pair.x, pair.y});
      }
      return {{member::pairs, std::move(lists)}};
    }
    case LayerKind::bases:
      return {{member::functions,
               {{member::views, shape.view_functions}, {member::lights, shape.light_functions}}}};
    case LayerKind::yarns: {
      const auto& [curves, nodes, stations] = shape.yarns;
      return {{member::curves, curves}, {member::nodes, nodes}, {member::stations, stations}};
    }
    default:
      return json::object();
  }
}

/// Drops a layer without another that it needs.
void require_layer(FabricHeader& header, LayerKind kind, LayerKind other, IssueSink& sink) {
  if (!header.layer(kind) || header.layer(other)) return;
  sink.add(Code::fabric_member, fmt::format("/{}/{}", member::layers, name_of(kind)),
           fmt::format("there is no layer {}", name_of(other)));
  header.layer(kind).reset();
}

/// Checks that products have bases, with all functions that they refer to.
void check_bases(FabricHeader& header, IssueSink& sink) {
  require_layer(header, LayerKind::products, LayerKind::bases, sink);
  auto& products = header.layer(LayerKind::products);
  if (!products) return;
  for (std::size_t i = 0; i < products->pairs.size(); ++i) {
    for (std::size_t m = 0; m < products->pairs[i].size(); ++m) {
      const V2i& pair = products->pairs[i][m];
      if (pair.x <= header.shape.view_functions && pair.y < header.shape.light_functions) continue;
      sink.add(
          Code::fabric_member,
          fmt::format("/{}/{}/{}/{}/{}", member::layers, name_of(LayerKind::products), member::pairs, i, m),
          fmt::format("({}, {}) is not a pair of the bases' functions", pair.x, pair.y));
      products.reset();
      return;
    }
  }
}

std::optional<LayerHeader> layer_from(LayerKind kind, const Member& layers, const Member& digests,
                                      const FabricLimits& limits, FabricHeader& header) {
  IssueSink& sink = *layers.sink;
  const char* name = name_of(kind);
  const std::size_t errors_before = sink.errors();
  const Member layer = layers.require_object(name);
  if (!layer) return std::nullopt;
  LayerHeader result;
  result.levels = levels_from(layer.require_array(member::levels), header.levels);
  std::vector<const char*> known{member::levels, member::precision, member::optional};
  const json own = own_members(kind, {}, {});
  for (const auto& item : own.items()) known.push_back(item.key().c_str());
  layer.warn_of_unknown_members(known);
  read_own_members(kind, layer, limits, result, header.shape);
  const auto optional = layer.value->find(member::optional);
  if (optional != layer.value->end() && !optional->is_boolean()) {
    sink.add(Code::fabric_member, pointer_to(layer.place, member::optional), "is neither true nor false");
  }
  const auto precision = layer.value->find(member::precision);
  if (precision == layer.value->end() ||
      (*precision != names::precision_half && *precision != names::precision_float)) {
    sink.add(Code::fabric_advice, pointer_to(layer.place, member::precision), "is neither half nor float");
  } else {
    result.half = *precision == names::precision_half;
  }
  if (!result.levels.empty()) {
    result.digests = digests_from(digests.require_array(name), result.levels.size());
  }
  if (!digests || sink.errors() > errors_before) return std::nullopt;
  return result;
}

void read_layers(const Member& text, FabricHeader& header, const FabricLimits& limits) {
  IssueSink& sink = *text.sink;
  const Member layers = text.require_object(member::layers);
  const Member digests = text.require_object(member::digests);
  if (!layers) return;
  for (const auto& item : layers.value->items()) {
    if (const auto kind = layer_named(item.key())) {
      header.layer(*kind) = layer_from(*kind, layers, digests, limits, header);
      continue;
    }
    const json& layer = item.value();
    const std::string place = pointer_to(layers.place, item.key());
    if (layer.is_object() && layer.contains(member::optional) && layer[member::optional] == true) {
      sink.add(Code::fabric_advice, place, "is not known; it is optional and is ignored");
    } else {
      sink.add(Code::fabric_unsupported, place, "is a layer that is not known, and it is not optional");
    }
  }
  if (!digests) return;
  for (const auto& item : digests.value->items()) {
    if (!layers.value->contains(item.key())) {
      sink.add(Code::fabric_advice, pointer_to(digests.place, item.key()), "is of no layer and is ignored");
    }
  }
}

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

std::string header_to_json(const FabricHeader& header) {
  json layers = json::object();
  json digests = json::object();
  for (const LayerKind kind : all_layers) {
    const auto& layer = header.layer(kind);
    if (!layer) continue;
    json& text = layers[name_of(kind)];
    text = own_members(kind, *layer, header.shape);
    text[member::levels] = layer->levels;
    text[member::precision] = layer->half ? names::precision_half : names::precision_float;
    if (kind == LayerKind::yarns || kind == LayerKind::indirect)
      text[member::optional] = true;  // beside level 0
    digests[name_of(kind)] = layer->digests;
  }
  json text = {
      {member::version, {names::fabric_version_major, names::fabric_version_minor}},
      {member::model, header.model},
      {member::texels, {header.width, header.height}},
      {member::levels, header.levels},
      {member::mm_per_repeat, {header.period_mm.x, header.period_mm.y}},
      {member::reference_height, header.reference_height},
      {member::thickness, header.thickness_mm},
      {member::views, grid_json(header.views)},
      {member::layers, layers},
      {member::digests, digests},
      {member::provenance, provenance_json(header.provenance)},
  };
  if (has_lights(header)) text[member::lights] = grid_json(header.lights);
  if (header.whole) text[member::whole] = whole_json(*header.whole);
  if (header.radiance_scale != 1) text[member::radiance_scale] = header.radiance_scale;
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
  if (minor != names::fabric_version_minor) {
    sink.add(Code::fabric_advice, "/version/1",
             fmt::format("minor version {}; what it may have added is not known", minor.dump()));
  }
  text.warn_of_unknown_members({member::version, member::model, member::texels, member::levels,
                                member::mm_per_repeat, member::reference_height, member::thickness,
                                member::radiance_scale, member::views, member::lights, member::layers,
                                member::digests, member::provenance, member::whole});
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
  if (text.has(member::radiance_scale)) {
    header.radiance_scale = text.require(member::radiance_scale).real_number(true).value_or(1);
  }
  const auto views = grid_member(text.require(member::views), limits);
  if (const Member provenance = text.require_object(member::provenance)) {
    header.provenance = provenance.value->dump();
  }
  const Member levels = text.require(member::levels);
  const int count = width && height ? levels.whole_number(1, level_count(*width, *height)).value_or(0) : 0;
  if (text.has(member::whole) && width && height) {
    if (const Member whole = text.require_object(member::whole)) {
      header.whole = whole_from(whole, V2i(*width, *height), count, limits);
    }
  }
  if (!width || !height || !views) return std::nullopt;
  header.width = *width;
  header.height = *height;
  header.views = *views;
  if (count == 0) return std::nullopt;
  header.levels = count;
  read_layers(text, header, limits);
  if (has_lights(header)) {
    const auto lights = grid_member(text.require(member::lights), limits);
    if (!lights) return std::nullopt;
    header.lights = *lights;
  }
  check_bases(header, sink);
  require_layer(header, LayerKind::yarns, LayerKind::indirect, sink);
  require_layer(header, LayerKind::indirect, LayerKind::yarns, sink);
  complete_shape(header);
  return header;
}

}  // namespace selvedge
