#include "format/fabric/layers_json.h"

#include <fmt/format.h>

#include <utility>

#include "format/base/json_text.h"
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
    if (layer.has(member::fields))
      shape.yarns.fields = number(layer, member::fields, fields_of_round_yarn, limits.fields);
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
      const auto& [curves, nodes, stations, fields] = shape.yarns;
      json own{{member::curves, curves}, {member::nodes, nodes}, {member::stations, stations}};
      if (fields > fields_of_round_yarn) own[member::fields] = fields;
      return own;
    }
    default:
      return json::object();
  }
}

std::string place_of(const Member& text, LayerKind kind) {
  return pointer_to(pointer_to(text.place, member::layers), name_of(kind));
}

}  // namespace

void require_layer(FabricHeader& header, LayerKind kind, const FabricHeader& others, LayerKind other,
                   const Member& text) {
  if (!header.layer(kind) || others.layer(other)) return;
  text.sink->add(Code::fabric_member, place_of(text, kind),
                 fmt::format("there is no layer {}", name_of(other)));
  header.layer(kind).reset();
}

void check_bases(FabricHeader& header, const Member& text) {
  require_layer(header, LayerKind::products, header, LayerKind::bases, text);
  auto& products = header.layer(LayerKind::products);
  if (!products) return;
  for (std::size_t i = 0; i < products->pairs.size(); ++i) {
    for (std::size_t m = 0; m < products->pairs[i].size(); ++m) {
      const V2i& pair = products->pairs[i][m];
      if (pair.x <= header.shape.view_functions && pair.y < header.shape.light_functions) continue;
      text.sink->add(Code::fabric_member,
                     fmt::format("{}/{}/{}/{}", place_of(text, LayerKind::products), member::pairs, i, m),
                     fmt::format("({}, {}) is not a pair of the bases' functions", pair.x, pair.y));
      products.reset();
      return;
    }
  }
}

namespace {

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
  if (kind == LayerKind::yarns) known.push_back(member::fields);
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

}  // namespace

void read_layers(const Member& text, FabricHeader& header, const FabricLimits& limits) {
  IssueSink& sink = *text.sink;
  const Member layers = text.require_object(member::layers);
  const Member digests = text.require_object(member::digests);
  if (!layers) return;
  for (const auto& item : layers.value->items()) {
    const auto kind = layer_named(item.key());
    if (kind && !layers_of(header.side).contains(*kind)) {
      sink.add(Code::fabric_member, pointer_to(layers.place, item.key()),
               fmt::format("{} does not have this layer", name_of(header.side)));
      continue;
    }
    if (kind) {
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

void write_layers(const FabricHeader& header, json& side) {
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
  side[member::layers] = std::move(layers);
  side[member::digests] = std::move(digests);
}

}  // namespace selvedge
