#include "format/fabric/header.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "format/base/json_text.h"
#include "format/fabric/json_io.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

using nlohmann::json;

/// Reads or writes the attribute text of one fabric.
class TextIo {
 public:
  explicit TextIo(const FabricLimits& limits) : limits_(limits) {}

  void root(const JsonIo& text, FabricHeader& header) const {
    text.integer_pair("texels", header.width, header.height, 1, limits_.texels_per_side);
    if (text.is_reading() && text.sink().has_error()) return;  // other members depend on them
    text.numbers("mmPerRepeat", {&header.period_mm.x, 2}, RealRule::positive);
    text.number("referenceHeight", header.reference_height);
    text.number("thickness", header.thickness_mm, RealRule::not_negative);
    text.integer("levels", header.levels, 1, level_count(header.width, header.height));
    if (text.is_reading()) check_reserved(text);
    side(text, header);
    for (auto& [name, value] :
         {std::pair("sheet", &header.data_sheet), std::pair("fallback", &header.fallback),
          std::pair("recipe", &header.recipe), std::pair("accuracy", &header.accuracy)})
      if (text.has_optional(name, *value != "{}")) any_members(text, name, *value);
    if (text.is_reading()) {
      require_layer(text, header, LayerKind::yarns, header, LayerKind::indirect);
      require_layer(text, header, LayerKind::indirect, header, LayerKind::yarns);
      require_layer(text, header, LayerKind::map, header, LayerKind::yarns);
      require_layer(text, header, LayerKind::map, header, LayerKind::products);
    }
    if (!text.has_optional("sides", !header.sides.empty())) return;
    const JsonIo sides = text.object("sides");
    for (const Side wanted : other_sides) {
      if (!sides || !sides.has_optional(name_of(wanted), header.find_side(wanted) != nullptr)) continue;
      const JsonIo other = sides.object(name_of(wanted));
      if (!other) continue;
      if (text.is_reading()) header.sides.push_back(new_side(header, wanted));
      FabricHeader& target = *std::ranges::find(header.sides, wanted, &FabricHeader::side);
      side(other, target);
      if (text.is_reading()) check_side(other, header, target);
    }
  }

 private:
  /// Members that later versions define.
  static void check_reserved(const JsonIo& text) {
    if (text.input_has("variation")) (void)text.object("variation");
    if (!text.input_has("colourways")) return;
    for (const JsonIo& item : text.items("colourways"))
      if (!item.value().is_object()) item.add_issue("is not an object");
  }

  /// An object of any members, as text.
  static void any_members(const JsonIo& text, const char* name, std::string& value) {
    if (!text.is_reading())
      text.set_member(name, provenance_json(value));
    else if (const JsonIo object = text.object(name))
      value = object.value().dump();
  }

  /// The members of every side.
  void side(const JsonIo& text, FabricHeader& header) const {
    if (text.has_optional("radianceScale", header.radiance_scale != 1))
      text.number("radianceScale", header.radiance_scale, RealRule::positive);
    any_members(text, "provenance", header.provenance);
    text.grid("views", header.views, limits_.directions);
    layers(text, header);
    const bool has_lights = header.layer(LayerKind::light) || header.layer(LayerKind::bases);
    if (has_lights) text.grid("lights", header.lights, limits_.directions);
    if (text.is_reading()) {
      require_layer(text, header, LayerKind::products, header, LayerKind::bases);
      LayerShape& shape = header.shape;
      shape.views = header.views.count();
      shape.lights = header.lights.count();
      shape.level0_texel_count = header.width * header.height;
      if (const auto& products = header.layer(LayerKind::products))
        for (const auto& pairs : products->pairs)
          shape.products = std::max(shape.products, static_cast<int>(pairs.size()));
    }
  }

  void layers(const JsonIo& text, FabricHeader& header) const {
    const JsonIo layers = text.object("layers");
    const JsonIo digests = text.object("digests");
    if (!layers || !digests) return;
    constexpr LayerSet without_map{LayerKind::lobes, LayerKind::frame, LayerKind::table, LayerKind::light};
    const bool has_map =
        text.is_reading() && (header.shape.yarns.map_size.x > 0 || layers.input_has(name_of(LayerKind::map)));
    for (const LayerKind kind : all_layers) {
      auto& layer = header.layer(kind);
      const char* name = name_of(kind);
      if (!layers.has_optional(name, layer.has_value())) continue;
      if (!side_layers(header.side).contains(kind)) {
        layers.add_issue(name, fmt::format("{} does not have this layer", name_of(header.side)));
        continue;
      }
      if (has_map && without_map.contains(kind)) layers.add_issue(name, "is beside a map");
      const JsonIo of_layer = layers.object(name);
      if (!of_layer) continue;
      if (!layer) layer.emplace();
      members_of(kind, of_layer, *layer, header);
      digests.strings(name, layer->digests, layer->levels.size());
    }
    if (text.is_reading()) check_unknown(layers);
  }

  void members_of(LayerKind kind, const JsonIo& text, LayerHeader& layer, FabricHeader& header) const {
    constexpr LayerSet of_level_0{LayerKind::bases, LayerKind::yarns, LayerKind::indirect, LayerKind::map};
    LayerShape& shape = header.shape;
    text.increasing_integers("levels", layer.levels, header.levels - 1);
    if (text.is_reading() && of_level_0.contains(kind) && layer.levels != std::vector{0})
      text.add_issue("levels", "is not level 0 alone");
    if (kind == LayerKind::lobes) text.integer("lobes", shape.lobes, 0, limits_.lobes);
    if (kind == LayerKind::products) pairs(text, layer);
    if (kind == LayerKind::bases) {
      if (const JsonIo functions = text.object("functions")) {
        functions.integer("views", shape.view_functions, 0, limits_.functions);
        functions.integer("lights", shape.light_functions, 1, limits_.functions);
      }
    }
    if (kind == LayerKind::yarns) text.yarn_counts(shape.yarns, limits_);
    if (kind == LayerKind::map) {
      V2i& size = shape.yarns.map_size;
      text.integer_pair("size", size.x, size.y, 1, max_map_stitches);
      if (text.is_reading() && std::int64_t{1} * size.x * size.y > max_map_stitches)
        text.add_issue("size", fmt::format("has more than {} stitches", max_map_stitches));
    }
    if (!text.is_reading()) {
      if (kind == LayerKind::yarns || kind == LayerKind::indirect) text.set_member("optional", true);
    } else if (text.input_has("optional") && !text.value()["optional"].is_boolean()) {
      text.add_issue("optional", "is neither true nor false");
    }
  }

  /// The pairs of functions of each of the layer's levels.
  void pairs(const JsonIo& text, LayerHeader& layer) const {
    if (!text.is_reading()) {
      json lists = json::array();
      for (const auto& pairs : layer.pairs) {
        json& list = lists.emplace_back(json::array());
        for (const V2i& pair : pairs) list.push_back({pair.x, pair.y});
      }
      return text.set_member("pairs", std::move(lists));
    }
    const std::size_t errors = text.sink().error_count();
    const std::vector<JsonIo> lists = text.items("pairs");
    if (lists.size() != layer.levels.size() && text.sink().error_count() == errors)
      text.add_issue("pairs",
                     fmt::format("has {} items, the layer {} levels", lists.size(), layer.levels.size()));
    for (const JsonIo& list : lists) {
      if (!list.value().is_array() || list.value().empty() ||
          std::cmp_greater(list.value().size(), limits_.products))
        return list.add_issue(fmt::format("is not an array of 1 to {} pairs", limits_.products));
      std::vector<V2i>& pairs = layer.pairs.emplace_back();
      for (const JsonIo& pair : list.items()) {
        const json& numbers = pair.value();
        const auto is_function = [&](std::size_t i, int count) {
          return numbers[i].is_number_integer() && numbers[i] >= 0 && numbers[i] < count;
        };
        if (!numbers.is_array() || numbers.size() != 2 || !is_function(0, limits_.functions + 1) ||
            !is_function(1, limits_.functions))
          return pair.add_issue("is not a pair of functions");
        pairs.emplace_back(numbers[0].get<int>(), numbers[1].get<int>());
      }
    }
  }

  static void check_unknown(const JsonIo& layers) {
    for (const auto& [name, layer] : layers.value().items()) {
      const bool optional = layer.is_object() && layer.contains("optional") && layer["optional"] == true;
      if (find_layer_kind(name) || optional) continue;
      layers.sink().add(Code::fabric_unsupported, member_pointer(layers.json_pointer(), name),
                        "is an unknown layer that is not optional");
    }
  }

  static void require_layer(const JsonIo& text, const FabricHeader& header, LayerKind kind,
                            const FabricHeader& others, LayerKind other) {
    if (header.layer(kind) && !others.layer(other))
      text.sink().add(Code::fabric_member, fmt::format("{}/layers/{}", text.json_pointer(), name_of(kind)),
                      fmt::format("there is no layer {}", name_of(other)));
  }

  static FabricHeader new_side(const FabricHeader& front, Side side) {
    FabricHeader header = front;
    header.sides.clear();
    header.layers = {};
    header.shape = {.side = side, .yarns = front.shape.yarns};
    header.side = side;
    header.radiance_scale = 1;
    return header;
  }

  static void check_side(const JsonIo& text, const FabricHeader& front, const FabricHeader& header) {
    const FabricHeader* const seen =
        front.find_side(header.side == Side::back_through ? Side::back : Side::front);
    if (seen == nullptr || (is_transmission(header.side) && header.views != seen->views))
      return text.add_issue("the views differ from the visible side's");
    require_layer(text, header, LayerKind::indirect, front, LayerKind::yarns);
    for (int k = 0; k < header.levels; ++k) {
      const int shown = header.texel_level(k);
      if (shown == k) continue;
      if (shown < 0) return text.add_issue(fmt::format("level {} and all coarser levels have no layer", k));
      if (header.has(LayerKind::frame, k) || header.has(LayerKind::opacity, k))
        return text.add_issue(fmt::format("level {} has a layer, but no reflectance", k));
    }
  }

  FabricLimits limits_;
};

void check_pairs(const FabricHeader& header, IssueSink& sink) {
  const auto& products = header.layer(LayerKind::products);
  if (!products) return;
  for (std::size_t i = 0; i < products->pairs.size(); ++i) {
    for (std::size_t m = 0; m < products->pairs[i].size(); ++m) {
      const V2i& pair = products->pairs[i][m];
      if (pair.x <= header.shape.view_functions && pair.y < header.shape.light_functions) continue;
      const std::string side =
          header.side == Side::front ? "" : fmt::format("/sides/{}", name_of(header.side));
      return sink.add(Code::fabric_member, fmt::format("{}/layers/products/pairs/{}/{}", side, i, m),
                      fmt::format("({}, {}) is not a pair of the bases' functions", pair.x, pair.y));
    }
  }
}

}  // namespace

FabricHeader header_without_layers(const Fabric& fabric) {
  FabricHeader header;
  static_cast<FabricInfo&>(header) = fabric;
  header.width = fabric.levels.front().width;
  header.height = fabric.levels.front().height;
  header.levels = static_cast<int>(fabric.levels.size());
  header.shape = layer_shape_of(fabric);
  return header;
}

const FabricHeader* FabricHeader::find_side(Side wanted) const {
  if (wanted == side) return this;
  const auto found = std::ranges::find_if(sides, [&](const FabricHeader& h) { return h.side == wanted; });
  return found == sides.end() ? nullptr : &*found;
}

int FabricHeader::index_in_layer(LayerKind kind, int level) const {
  if (!layer(kind)) return -1;
  const std::vector<int>& present = layer(kind)->levels;
  const auto found = std::ranges::find(present, level);
  return found == present.end() ? -1 : static_cast<int>(found - present.begin());
}

int FabricHeader::texel_level(int level) const {
  if (side == Side::front) return level;
  constexpr std::array reflecting{LayerKind::lobes, LayerKind::table, LayerKind::light, LayerKind::products};
  for (int k = level; k < levels; ++k)
    if (std::ranges::any_of(reflecting, [&](LayerKind kind) { return has(kind, k); })) return k;
  return -1;
}

std::string header_to_json(FabricHeader header) {
  // Readers of version 4 would misread packed yarn and maps.
  const bool is_packed = header.shape.yarns.light_functions > 0;
  const bool has_map = header.layer(LayerKind::map).has_value();
  json text = {{"version",
                {is_packed || has_map ? names::version_of_packed_yarn : names::fabric_version_major,
                 has_map ? names::minor_version_of_maps : names::fabric_version_minor}}};
  TextIo({}).root(JsonIo::writer(text), header);
  return text.dump();
}

std::optional<FabricHeader> header_from_json(const std::string& text, const FabricLimits& limits,
                                             IssueSink& sink) {
  const json parsed = parse_json(text);
  if (!parsed.is_object()) {
    sink.add(Code::fabric_malformed, names::attribute_fabric, "is not a JSON object");
    return std::nullopt;
  }
  const auto version = parsed.find("version");
  const auto is_number = [](const json& n) { return n.is_number_integer() && n >= 0; };
  if (version == parsed.end() || !version->is_array() || version->size() != 2 || !is_number((*version)[0]) ||
      !is_number((*version)[1])) {
    sink.add(Code::fabric_member, "/version", "is not a pair of whole numbers");
    return std::nullopt;
  }
  const json& major = (*version)[0];
  if (major != names::fabric_version_major && major != names::version_of_packed_yarn) {
    const std::string number = major.dump() + "." + (*version)[1].dump();
    sink.add(
        Code::fabric_version, "/version",
        major < names::fabric_version_major
            ? fmt::format("fabric version {} is no longer read: make the fabric again with 'selvedge make'",
                          number)
            : fmt::format("fabric version {} is not known, only {}.x and {}.x", number,
                          names::fabric_version_major, names::version_of_packed_yarn));
    return std::nullopt;
  }
  const std::size_t errors = sink.error_count();
  FabricHeader header;
  TextIo(limits).root(JsonIo::reader(parsed, Code::fabric_member, sink), header);
  if (sink.error_count() == errors)
    for_each_side(header, [&](const FabricHeader& h) { check_pairs(h, sink); });
  if (sink.error_count() > errors) return std::nullopt;
  return header;
}

}  // namespace selvedge
