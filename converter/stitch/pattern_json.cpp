#include "converter/stitch/pattern_json.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "converter/stitch/fibres.h"
#include "converter/stitch/parameters.h"
#include "converter/stitch/text_fault.h"
#include "format/base/atomic_file.h"
#include "format/base/json_text.h"

namespace selvedge {
namespace {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

constexpr auto version_key = "selvedge_stitch";
constexpr int version = 1;

const Json& member(const Json& object, const std::string& place, const char* name) {
  if (!object.is_object()) refuse_text(place, "must be an object");
  const auto found = object.find(name);
  if (found == object.end()) refuse_text(place + "/" + name, "is missing");
  return *found;
}

double number(const Json& value, const std::string& place) {
  if (!value.is_number()) refuse_text(place, fmt::format("must be a number, is {}", value.type_name()));
  return value.get<double>();
}

std::string text_of(const Json& value, const std::string& place) {
  if (!value.is_string()) refuse_text(place, fmt::format("must be a string, is {}", value.type_name()));
  return value.get<std::string>();
}

const Json& array_of(const Json& value, const std::string& place, std::size_t size) {
  if (!value.is_array()) refuse_text(place, fmt::format("must be an array, is {}", value.type_name()));
  if (size > 0 && value.size() != size)
    refuse_text(place, fmt::format("must have {} elements, has {}", size, value.size()));
  return value;
}

V3d vector3(const Json& value, const std::string& place) {
  array_of(value, place, 3);
  return {number(value[0], place + "/0"), number(value[1], place + "/1"), number(value[2], place + "/2")};
}

/// Member `albedo`, or else `colour`.
V3f albedo_of(const Json& json, const std::string& place) {
  if (!json.is_object() || !json.contains("colour") || json.contains("albedo"))
    return V3f(vector3(member(json, place, "albedo"), place + "/albedo"));
  const auto colour = linear_colour(text_of(json["colour"], place + "/colour"));
  if (!colour) refuse_text(place + "/colour", "must be of the form #rrggbb");
  return V3f(*colour);
}

Yarn yarn_of(const Json& json, const std::string& place) {
  Yarn yarn;
  if (json.is_object() && json.contains("name")) yarn.name = text_of(json["name"], place + "/name");
  yarn.radius_mm = number(member(json, place, "radius_mm"), place + "/radius_mm");
  yarn.albedo = albedo_of(json, place);
  const auto optional = [&](const char* name, double fallback) {
    return json.contains(name) ? number(json[name], place + "/" + name) : fallback;
  };
  if (json.contains("fibre")) {
    const auto kind = find_yarn_kind(text_of(json["fibre"], place + "/fibre"));
    if (!kind) refuse_text(place + "/fibre", "must be one of " + yarn_kind_names());
    set_fibre(*kind, yarn);
  }
  for (const YarnMember& m : yarn_members()) {
    if (!json.contains(m.name)) continue;
    const double value = optional(m.name, 0);
    if (m.whole && !(value == std::floor(value) && std::abs(value) <= 1000))
      refuse_text(fmt::format("{}/{}", place, m.name), fmt::format("must be a whole number, is {}", value));
    m.set(yarn, value);
  }
  if (json.contains("twist_degrees")) {
    const double degrees = optional("twist_degrees", 0);
    if (!(std::abs(degrees) < 90))
      refuse_text(place + "/twist_degrees", fmt::format("must lie between -90 and 90, is {}", degrees));
    yarn.twist_per_mm = twist_of_angle(degrees, yarn.radius_mm);
  }
  yarn.flattening = optional("flattening", yarn.flattening);
  const Json& segments = array_of(member(json, place, "segments"), place + "/segments", 0);
  for (std::size_t s = 0; s < segments.size(); ++s) {
    const std::string at = fmt::format("{}/segments/{}", place, s);
    const Json& points = array_of(segments[s], at, 4);
    BezierSegment segment;
    for (std::size_t p = 0; p < 4; ++p) segment[p] = vector3(points[p], fmt::format("{}/{}", at, p));
    yarn.segments.push_back(segment);
  }
  if (json.contains("squeezes")) {
    const std::string at = place + "/squeezes";
    const Json& squeezes = array_of(json["squeezes"], at, segments.size());
    for (std::size_t s = 0; s < squeezes.size(); ++s)
      yarn.squeezes.push_back(vector3(squeezes[s], fmt::format("{}/{}", at, s)));
  }
  return yarn;
}

StitchPattern pattern_of(const Json& json) {
  if (!json.is_object() || !json.contains(version_key))
    refuse_text(
        fmt::format("/{}", version_key),
        "is missing: the JSON is of another program; write a chart as text (.txt), or export a draft as WIF");
  const Json& stated = json[version_key];
  if (!stated.is_number_integer() || stated != version)
    refuse_text(fmt::format("/{}", version_key), fmt::format("must be {}, is {}", version, stated.dump()));
  StitchPattern pattern;
  pattern.name = text_of(member(json, "", "name"), "/name");
  const Json& period = array_of(member(json, "", "period_mm"), "/period_mm", 2);
  pattern.period_mm = {number(period[0], "/period_mm/0"), number(period[1], "/period_mm/1")};
  if (json.contains("seed")) {
    const double seed = number(json["seed"], "/seed");
    if (!(seed >= 0 && seed <= max_seed && seed == std::floor(seed)))
      refuse_text("/seed", fmt::format("must be a whole number from 0 to {}, is {}", max_seed, seed));
    pattern.seed = static_cast<std::uint32_t>(seed);
  }
  const Json& yarns = array_of(member(json, "", "yarns"), "/yarns", 0);
  for (std::size_t y = 0; y < yarns.size(); ++y)
    pattern.yarns.push_back(yarn_of(yarns[y], fmt::format("/yarns/{}", y)));
  return pattern;
}

}  // namespace

Result<StitchPattern> read_stitch(std::string_view text, const std::string& file) {
  if (text.size() > max_stitch_bytes)
    return fail(Code::file_too_large, file, "",
                fmt::format("{} bytes, a stitch description has at most {}", text.size(), max_stitch_bytes));
  try {
    return with_file_name(file, [&] {
      StitchPattern pattern = pattern_of(Json::parse(text));
      value_or_throw(validate(pattern, file));
      return pattern;
    });
  } catch (const Json::parse_error& error) {
    return fail(Code::json_malformed, file, line_and_column(text, error.byte), exception_message(error));
  } catch (const Json::exception& error) {  // e.g. a number beyond double
    return fail(Code::json_malformed, file, "", exception_message(error));
  }
}

std::string to_json(const StitchPattern& pattern) {
  // Names may hold any bytes; invalid UTF-8 is replaced.
  const auto dumped = [](const OrderedJson& json) {
    return json.dump(-1, ' ', false, OrderedJson::error_handler_t::replace);
  };
  std::string text = fmt::format("{{\"{}\":{},\"name\":{},\"period_mm\":{}", version_key, version,
                                 dumped(pattern.name), dumped({pattern.period_mm.x, pattern.period_mm.y}));
  if (pattern.seed != StitchPattern().seed) text += fmt::format(",\"seed\":{}", pattern.seed);
  text += ",\"yarns\":[";
  // One by one: as a tree all of them take many times the memory.
  for (const Yarn& yarn : pattern.yarns) {
    OrderedJson out;
    out["name"] = yarn.name;
    out["radius_mm"] = yarn.radius_mm;
    out["albedo"] = {shortest_decimal(yarn.albedo.x), shortest_decimal(yarn.albedo.y),
                     shortest_decimal(yarn.albedo.z)};
    if (yarn.fibre_kind != 0) out["fibre"] = yarn_kinds()[yarn.fibre_kind].name;
    const bool glossy = yarn.gloss.weight > 0 || yarn.fibre_kind != 0;
    for (const YarnMember& m : yarn_members()) {
      const std::string name = m.name;
      const double value = m.get(yarn);
      const bool of_fibre = name == "transmission" || name == "packing" || name == "lustre";
      const bool of_hairs = name == "hair_mm" || name == "hair_loops";
      bool said = value != m.get(Yarn()) || (of_fibre && yarn.fibre_kind != 0);
      if (name == "gloss" || name == "roughness") said = glossy;
      if (!said || (of_hairs && yarn.hairiness == 0)) continue;
      out[name] = m.whole ? OrderedJson(static_cast<int>(value)) : OrderedJson(value);
    }
    if (yarn.flattening != 1) out["flattening"] = yarn.flattening;
    out["segments"] = OrderedJson::array();
    for (const BezierSegment& segment : yarn.segments) {
      OrderedJson points = OrderedJson::array();
      for (const V3d& p : segment) points.push_back({p.x, p.y, p.z});
      out["segments"].push_back(std::move(points));
    }
    for (const V3d& g : yarn.squeezes) out["squeezes"].push_back({g.x, g.y, g.z});
    text += (&yarn == &pattern.yarns.front() ? "\n" : ",\n") + dumped(out);
  }
  text += "]}\n";
  return text;
}

}  // namespace selvedge
