#include "format/fabric/header_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "format/base/json_text.h"
#include "format/fabric/json_parts.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

using nlohmann::json;
namespace member = names::member;

/// A member on its way out of the text: where it is, and the value, null where it is missing.
struct Member {
  const json* value = nullptr;
  std::string place;
  IssueSink* sink = nullptr;

  explicit operator bool() const { return value != nullptr; }
  void refuse(std::string message) const { sink->add(Code::fabric_member, place, std::move(message)); }
};

/// A member that has to be there.
Member require(const json& object, const std::string& parent, const char* key, IssueSink& sink) {
  const auto found = object.find(key);
  Member result{nullptr, pointer_to(parent, key), &sink};
  if (found == object.end()) {
    result.refuse("is missing");
  } else {
    result.value = &*found;
  }
  return result;
}

/// The same of a certain type; `type` is for the message.
Member require(const json& object, const std::string& parent, const char* key, json::value_t type,
               const char* type_name, IssueSink& sink) {
  Member result = require(object, parent, key, sink);
  if (result && result.value->type() != type) {
    result.refuse(fmt::format("is not {}", type_name));
    result.value = nullptr;
  }
  return result;
}

Member require_object(const json& object, const std::string& parent, const char* key, IssueSink& sink) {
  return require(object, parent, key, json::value_t::object, "an object", sink);
}

Member require_array(const json& object, const std::string& parent, const char* key, IssueSink& sink) {
  return require(object, parent, key, json::value_t::array, "an array", sink);
}

std::optional<int> whole_number(const Member& from, int least, int most) {
  if (!from) return std::nullopt;
  if (!from.value->is_number_integer()) {
    from.refuse("is not a whole number");
  } else if (*from.value < least || *from.value > most) {
    from.refuse(fmt::format("{} is outside of {} to {}", from.value->dump(), least, most));
  } else {
    return from.value->get<int>();
  }
  return std::nullopt;
}

/// Rounded to single precision, in which it has to be finite and, if `positive`, above 0.
std::optional<float> real_number(const Member& from, bool positive = false) {
  if (!from) return std::nullopt;
  const double value = from.value->is_number() ? from.value->get<double>() : 0;
  if (!from.value->is_number()) {
    from.refuse("is not a number");
  } else if (std::abs(value) > static_cast<double>(std::numeric_limits<float>::max())) {
    from.refuse("is beyond single precision");
  } else if (positive && !(static_cast<float>(value) > 0)) {
    from.refuse(fmt::format("{} is not positive", from.value->dump()));
  } else {
    return static_cast<float>(value);
  }
  return std::nullopt;
}

/// Both items of an array of two; their values are null where it is not that.
std::array<Member, 2> require_pair(const json& object, const std::string& parent, const char* key,
                                   IssueSink& sink) {
  const Member list = require_array(object, parent, key, sink);
  std::array<Member, 2> items;
  if (list && list.value->size() != 2) list.refuse("does not have two items");
  if (!list || list.value->size() != 2) return items;
  for (std::size_t i = 0; i < 2; ++i)
    items[i] = {&(*list.value)[i], fmt::format("{}/{}", list.place, i), &sink};
  return items;
}

void advise_on_members(const json& object, const std::string& place, const std::vector<const char*>& known,
                       IssueSink& sink) {
  for (const auto& item : object.items()) {
    if (std::none_of(known.begin(), known.end(), [&](const char* k) { return item.key() == k; })) {
      sink.add(Code::fabric_advice, pointer_to(place, item.key()), "is not known and is ignored");
    }
  }
}

std::vector<int> levels_from(const Member& list, int levels) {
  std::vector<int> result;
  if (!list) return result;
  if (list.value->empty()) list.refuse("names no level");
  for (std::size_t i = 0; i < list.value->size(); ++i) {
    const Member item{&(*list.value)[i], fmt::format("{}/{}", list.place, i), list.sink};
    const auto level = whole_number(item, 0, levels - 1);
    if (!level) return {};
    if (!result.empty() && *level <= result.back()) {
      item.refuse(fmt::format("{} does not come after {}", *level, result.back()));
      return {};
    }
    result.push_back(*level);
  }
  return result;
}

/// Strings, one for each of the layer's levels.
std::vector<std::string> digests_from(const Member& list, std::size_t count) {
  std::vector<std::string> result;
  if (!list) return result;
  if (list.value->size() != count) {
    list.refuse(fmt::format("has {} items, the layer {} levels", list.value->size(), count));
    return result;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const json& digest = (*list.value)[i];
    if (!digest.is_string()) {
      list.sink->add(Code::fabric_member, fmt::format("{}/{}", list.place, i), "is not a string");
      return {};
    }
    result.push_back(digest.get<std::string>());
  }
  return result;
}

/// Levels' lists of pairs of functions, one for each of the layer's levels.
std::vector<std::vector<V2i>> pairs_from(const Member& lists, std::size_t count, const FabricLimits& limits) {
  std::vector<std::vector<V2i>> result;
  if (!lists) return result;
  if (lists.value->size() != count) {
    lists.refuse(fmt::format("has {} items, the layer {} levels", lists.value->size(), count));
    return result;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Member list{&(*lists.value)[i], fmt::format("{}/{}", lists.place, i), lists.sink};
    const bool fits = list.value->is_array() && !list.value->empty() &&
                      list.value->size() <= static_cast<std::size_t>(limits.products);
    if (!fits) {
      list.refuse(fmt::format("is not an array of 1 to {} pairs", limits.products));
      return result;
    }
    std::vector<V2i> pairs;
    for (std::size_t m = 0; m < list.value->size(); ++m) {
      const json& pair = (*list.value)[m];
      const Member item{&pair, fmt::format("{}/{}", list.place, m), lists.sink};
      if (!pair.is_array() || pair.size() != 2) {
        item.refuse("is not a pair of whole numbers");
        return result;
      }
      const auto view = whole_number({&pair[0], item.place + "/0", item.sink}, 0, limits.functions);
      const auto light = whole_number({&pair[1], item.place + "/1", item.sink}, 0, limits.functions - 1);
      if (!view || !light) return result;
      pairs.emplace_back(*view, *light);
    }
    result.push_back(std::move(pairs));
  }
  return result;
}

/// What only some layers have besides levels and precision.
void own_members_from(Layer which, const Member& object, const FabricLimits& limits, LayerHeader& result,
                      IssueSink& sink) {
  const json& layer = *object.value;
  const auto number = [&](const char* name, int least, int most) {
    return whole_number(require(layer, object.place, name, sink), least, most).value_or(least);
  };
  if (which == Layer::lobes) result.lobes = number(member::lobes, 0, limits.lobes);
  if (which == Layer::heights) {
    result.cells.columns = number(member::columns, 1, limits.cells_per_side);
    result.cells.rows = number(member::rows, 1, limits.cells_per_side);
    result.cells.slabs = number(member::slabs, 1, limits.slabs);
  }
  if (which == Layer::products) {
    result.pairs =
        pairs_from(require_array(layer, object.place, member::pairs, sink), result.levels.size(), limits);
  }
  if (which == Layer::bases) {
    const Member functions = require_object(layer, object.place, member::functions, sink);
    if (result.levels != std::vector{0}) {
      sink.add(Code::fabric_member, pointer_to(object.place, member::levels), "is not level 0 alone");
    }
    if (!functions) return;
    result.view_functions =
        whole_number(require(*functions.value, functions.place, member::views, sink), 0, limits.functions)
            .value_or(0);
    result.light_functions =
        whole_number(require(*functions.value, functions.place, member::lights, sink), 1, limits.functions)
            .value_or(1);
  }
}

/// Members of a layer that are known.
std::vector<const char*> members_of(Layer which) {
  std::vector<const char*> known{member::levels, member::precision, member::optional};
  if (which == Layer::lobes) known.push_back(member::lobes);
  if (which == Layer::heights) known.insert(known.end(), {member::columns, member::rows, member::slabs});
  if (which == Layer::products) known.push_back(member::pairs);
  if (which == Layer::bases) known.push_back(member::functions);
  return known;
}

/// Layers that others need: products have bases, and name functions that these have.
void check_bases(FabricHeader& header, IssueSink& sink) {
  auto& products = header.layer(Layer::products);
  const auto& bases = header.layer(Layer::bases);
  if (!products) return;
  const std::string place = fmt::format("/{}/{}", member::layers, name_of(Layer::products));
  if (!bases) {
    sink.add(Code::fabric_member, place, fmt::format("there is no layer {}", name_of(Layer::bases)));
    products.reset();
    return;
  }
  for (std::size_t i = 0; i < products->pairs.size(); ++i) {
    for (std::size_t m = 0; m < products->pairs[i].size(); ++m) {
      const V2i& pair = products->pairs[i][m];
      if (pair.x <= bases->view_functions && pair.y < bases->light_functions) continue;
      sink.add(Code::fabric_member, fmt::format("{}/{}/{}/{}", place, member::pairs, i, m),
               fmt::format("({}, {}) is not a pair of the bases' functions", pair.x, pair.y));
      products.reset();
      return;
    }
  }
}

std::optional<LayerHeader> layer_from(Layer which, const Member& layers, const Member& digests,
                                      const FabricHeader& header, const FabricLimits& limits,
                                      IssueSink& sink) {
  const char* name = name_of(which);
  const std::size_t errors_before = sink.errors();
  const Member object = require_object(*layers.value, layers.place, name, sink);
  if (!object) return std::nullopt;
  const json& layer = *object.value;
  LayerHeader result;
  result.levels = levels_from(require_array(layer, object.place, member::levels, sink), header.levels);
  advise_on_members(layer, object.place, members_of(which), sink);
  own_members_from(which, object, limits, result, sink);
  const auto optional = layer.find(member::optional);
  if (optional != layer.end() && !optional->is_boolean()) {
    sink.add(Code::fabric_member, pointer_to(object.place, member::optional), "is neither true nor false");
  }
  const auto precision = layer.find(member::precision);
  if (precision == layer.end() ||
      (*precision != names::precision_half && *precision != names::precision_float)) {
    sink.add(Code::fabric_advice, pointer_to(object.place, member::precision), "is neither half nor float");
  } else {
    result.half = *precision == names::precision_half;
  }
  if (digests && !result.levels.empty()) {
    result.digests =
        digests_from(require_array(*digests.value, digests.place, name, sink), result.levels.size());
  }
  if (!digests || sink.errors() > errors_before) return std::nullopt;
  return result;
}

void layers_from(const json& text, FabricHeader& header, const FabricLimits& limits, IssueSink& sink) {
  const Member layers = require_object(text, {}, member::layers, sink);
  const Member digests = require_object(text, {}, member::digests, sink);
  if (!layers) return;
  for (const auto& item : layers.value->items()) {
    if (const auto which = layer_named(item.key())) {
      header.layer(*which) = layer_from(*which, layers, digests, header, limits, sink);
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

void add_own_members(Layer which, const LayerHeader& layer, json& text) {
  if (which == Layer::lobes) text[member::lobes] = layer.lobes;
  if (which == Layer::heights) {
    text[member::columns] = layer.cells.columns;
    text[member::rows] = layer.cells.rows;
    text[member::slabs] = layer.cells.slabs;
  }
  if (which == Layer::products) {
    text[member::pairs] = json::array();
    for (const auto& pairs : layer.pairs) {
      json list = json::array();
      for (const V2i& pair : pairs) list.push_back({pair.x, pair.y});
      text[member::pairs].push_back(std::move(list));
    }
  }
  if (which == Layer::bases) {
    text[member::functions] = {{member::views, layer.view_functions},
                               {member::lights, layer.light_functions}};
  }
}

/// Whether a layer of the file is laid out over lights.
bool has_lights(const FabricHeader& header) {
  return header.layer(Layer::light).has_value() || header.layer(Layer::bases).has_value();
}

/// The fabric that `levels` levels, of which the first has `texels`, are levels of; 0: their number is bad.
std::optional<WholeFabric> whole_from(const Member& of, const V2i& texels, int levels,
                                      const FabricLimits& limits) {
  if (!of) return std::nullopt;
  advise_on_members(*of.value, of.place, {member::level, member::levels, member::texels}, *of.sink);
  const auto size = require_pair(*of.value, of.place, member::texels, *of.sink);
  const auto width = whole_number(size[0], 1, limits.texels_per_side);
  const auto height = whole_number(size[1], 1, limits.texels_per_side);
  const Member level = require(*of.value, of.place, member::level, *of.sink);
  if (!width || !height) return std::nullopt;
  const int all = level_count(*width, *height);
  const auto number = whole_number(level, 0, all - 1);
  if (!number) return std::nullopt;
  WholeFabric whole{V2i(*width, *height), *number};
  if (!is_level_of(whole, texels.x, texels.y)) {
    of.refuse(fmt::format("level {} of {}x{} texels does not have {}x{}", *number, *width, *height, texels.x,
                          texels.y));
    return std::nullopt;
  }
  if (of.value->contains(member::levels)) {
    const auto count =
        whole_number(require(*of.value, of.place, member::levels, *of.sink), *number + levels, all);
    if (!count) return std::nullopt;
    whole.levels = *count;
  }
  if (levels == 0 || is_more_than(whole, levels)) return whole;
  level.refuse("is 0, and no coarser level is missing");
  return std::nullopt;
}

/// A grid of directions; the sink says why there is none.
std::optional<DirectionGrid> grid_member(const Member& grid, const FabricLimits& limits) {
  if (!grid) return std::nullopt;
  const auto result = grid_from(*grid.value, limits.directions);
  if (!result) {
    grid.sink->add(result.error().code, grid.place + result.error().place, result.error().message);
    return std::nullopt;
  }
  advise_on_members(*grid.value, grid.place, {member::layout, member::columns, member::rows}, *grid.sink);
  return *result;
}

}  // namespace

std::string text_of(const FabricHeader& header) {
  json layers = json::object();
  json digests = json::object();
  for (const Layer which : all_layers) {
    const auto& layer = header.layer(which);
    if (!layer) continue;
    const char* name = name_of(which);
    layers[name] = {{member::levels, layer->levels},
                    {member::precision, layer->half ? names::precision_half : names::precision_float}};
    add_own_members(which, *layer, layers[name]);
    digests[name] = layer->digests;
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
  const auto version = require_pair(parsed, {}, member::version, sink);
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
  if (!whole_number(version[1], 0, std::numeric_limits<int>::max())) return std::nullopt;
  return parsed;
}

std::optional<FabricHeader> header_of(const json& text, const FabricLimits& limits, IssueSink& sink) {
  FabricHeader header;
  const json& minor = text[member::version][1];
  if (minor != names::fabric_version_minor) {
    sink.add(Code::fabric_advice, "/version/1",
             fmt::format("minor version {}; what it may have added is not known", minor.dump()));
  }
  advise_on_members(text, {},
                    {member::version, member::model, member::texels, member::levels, member::mm_per_repeat,
                     member::reference_height, member::thickness, member::radiance_scale, member::views,
                     member::lights, member::layers, member::digests, member::provenance, member::whole},
                    sink);
  const auto model = text.find(member::model);
  if (model == text.end() || !model->is_string()) {
    sink.add(Code::fabric_advice, "/model", "is missing or not a string");
  } else {
    header.model = model->get<std::string>();
  }
  const auto texels = require_pair(text, {}, member::texels, sink);
  const auto width = whole_number(texels[0], 1, limits.texels_per_side);
  const auto height = whole_number(texels[1], 1, limits.texels_per_side);
  const auto period = require_pair(text, {}, member::mm_per_repeat, sink);
  header.period_mm.x = real_number(period[0], true).value_or(1);
  header.period_mm.y = real_number(period[1], true).value_or(1);
  header.reference_height = real_number(require(text, {}, member::reference_height, sink)).value_or(0);
  const Member thickness = require(text, {}, member::thickness, sink);
  header.thickness_mm = real_number(thickness).value_or(0);
  if (header.thickness_mm < 0) thickness.refuse("is negative");
  if (text.contains(member::radiance_scale)) {
    const Member scale = require(text, {}, member::radiance_scale, sink);
    header.radiance_scale = real_number(scale, true).value_or(1);
  }
  const auto views = grid_member(require(text, {}, member::views, sink), limits);
  if (const Member provenance = require_object(text, {}, member::provenance, sink)) {
    header.provenance = provenance.value->dump();
  }
  const Member levels = require(text, {}, member::levels, sink);
  const int count = width && height ? whole_number(levels, 1, level_count(*width, *height)).value_or(0) : 0;
  if (text.contains(member::whole) && width && height) {
    header.whole =
        whole_from(require_object(text, {}, member::whole, sink), V2i(*width, *height), count, limits);
  }
  if (!width || !height || !views) return std::nullopt;
  header.width = *width;
  header.height = *height;
  header.views = *views;
  if (count == 0) return std::nullopt;
  header.levels = count;
  layers_from(text, header, limits, sink);
  if (has_lights(header)) {
    const auto lights = grid_member(require(text, {}, member::lights, sink), limits);
    if (!lights) return std::nullopt;
    header.lights = *lights;
  }
  check_bases(header, sink);
  return header;
}

}  // namespace selvedge
