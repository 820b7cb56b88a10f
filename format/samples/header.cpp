#include "format/samples/header.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "format/base/json_text.h"
#include "format/fabric/json_parts.h"
#include "format/fabric/names.h"

namespace selvedge {
namespace {

using nlohmann::json;
namespace member = names::member;

constexpr ByPairKind<const char*> pair_parts{names::part_validation, names::part_held_out,
                                             names::part_measured};

// Readers of members throw; samples_header_from_json() adds the name of the member.

int whole(const json& number, int min, int max) {
  if (!number.is_number_integer() || number < min || number > max)
    throw std::runtime_error(fmt::format("is not a whole number from {} to {}", min, max));
  return number.get<int>();
}

float real(const json& number, bool (*good)(float), const char* fault) {
  const auto value = number.get<float>();
  if (!std::isfinite(value) || !good(value)) throw std::runtime_error(fault);
  return value;
}

float length(const json& number) {
  return real(
      number, [](float value) { return value > 0; }, "is not a length");
}

json list_of(const V3f& v) { return {v.x, v.y, v.z}; }

/// A unit vector, of the upper hemisphere unless both sides are known.
V3f direction(const json& list, bool both_sides) {
  const V3f v(list.at(0).get<float>(), list.at(1).get<float>(), list.at(2).get<float>());
  if (!(std::abs(v.length() - 1) < 1e-3F) || !(v.z >= 0 || both_sides))
    throw std::runtime_error("has a vector that is not a unit direction above the cloth");
  return v;
}

/// A grid with its directions, which are informative.
json grid_with_directions(const DirectionGrid& grid) {
  json directions = json::array();
  for (const V3f& d : directions_of(grid)) directions.push_back(list_of(d));
  json result = grid_json(grid);
  result[member::directions] = directions;
  return result;
}

DirectionGrid grid(const json& text) {
  const auto read = grid_from_json(text, FabricLimits{}.directions);
  if (!read) throw std::runtime_error(fmt::format("{} {}", read.error().place, read.error().message));
  return *read;
}

json pairs_json(const SamplesHeader& h) {
  json sets = json::object();
  for (const PairKind kind : all_pair_kinds) {
    const auto& pairs = h.pairs[index_of(kind)];
    if (kind == PairKind::measured && pairs.empty()) continue;
    json& list = sets[name_of(kind)] = json::array();
    for (const DirectionPair& pair : pairs)
      list.push_back({{member::light, list_of(pair.light)}, {member::view, list_of(pair.view)}});
  }
  return sets;
}

void read_pairs(const json& sets, SamplesHeader& h) {
  for (const PairKind kind : all_pair_kinds) {
    if (kind == PairKind::measured && !sets.contains(name_of(kind))) continue;
    for (const json& pair : sets.at(name_of(kind)))
      h.pairs[index_of(kind)].push_back(
          {direction(pair.at(member::light), h.both_sides), direction(pair.at(member::view), h.both_sides)});
  }
}

json yarns_json(const SamplesHeader& h) {
  if (h.yarns.curves == 0) return nullptr;
  return {{member::curves, h.yarns.curves},
          {member::nodes, h.yarns.nodes},
          {member::stations, h.yarns.stations},
          {member::fields, h.yarns.fields}};
}

void read_yarns(const json& text, SamplesHeader& h) {
  const FabricLimits limits;
  h.yarns = {whole(text.at(member::curves), 1, limits.curves), whole(text.at(member::nodes), 1, limits.nodes),
             whole(text.at(member::stations), 1, limits.stations)};
  h.yarns.fields = whole(text.at(member::fields), min_yarn_fields, limits.fields);
}

void read_version(const json& version, SamplesHeader& /*header*/) {
  if (version != names::samples_version)
    throw std::runtime_error(fmt::format("{} is not understood: this program reads version {}",
                                         version.dump(), names::samples_version));
}

constexpr int max_samples = std::numeric_limits<int>::max();

/// A member of the attribute text. Members are read in this order.
struct Field {
  const char* name;
  bool optional;
  json (*get)(const SamplesHeader& header);  ///< null: left out
  void (*set)(const json& value, SamplesHeader& header);
};
const std::array<Field, 13> fields{{
    {member::version, false, [](const SamplesHeader&) { return json(names::samples_version); }, read_version},
    {member::texels, false,
     [](const SamplesHeader& h) {
       return json{h.width, h.height};
     },
     [](const json& v, SamplesHeader& h) {
       const int max = FabricLimits{}.texels_per_side;
       h.width = whole(v.at(0), 1, max);
       h.height = whole(v.at(1), 1, max);
     }},
    {member::mm_per_repeat, false,
     [](const SamplesHeader& h) {
       return json{h.period_mm.x, h.period_mm.y};
     },
     [](const json& v, SamplesHeader& h) {
       h.period_mm = {length(v.at(0)), length(v.at(1))};
     }},
    {member::reference_height, false, [](const SamplesHeader& h) { return json(h.reference_height); },
     [](const json& v, SamplesHeader& h) {
       h.reference_height = real(
           v, [](float) { return true; }, "is not finite");
     }},
    {member::thickness, false, [](const SamplesHeader& h) { return json(h.thickness_mm); },
     [](const json& v, SamplesHeader& h) {
       h.thickness_mm = real(
           v, [](float value) { return value >= 0; }, "is not a length");
     }},
    {member::views, false, [](const SamplesHeader& h) { return grid_with_directions(h.views); },
     [](const json& v, SamplesHeader& h) { h.views = grid(v); }},
    {member::lights, false, [](const SamplesHeader& h) { return grid_with_directions(h.lights); },
     [](const json& v, SamplesHeader& h) { h.lights = grid(v); }},
    {member::samples_per_texel, false, [](const SamplesHeader& h) { return json(h.samples_per_texel); },
     [](const json& v, SamplesHeader& h) { h.samples_per_texel = whole(v, 0, max_samples); }},
    {member::truth_samples, false, [](const SamplesHeader& h) { return json(h.truth_samples); },
     [](const json& v, SamplesHeader& h) { h.truth_samples = whole(v, 0, max_samples); }},
    {member::sides, true, [](const SamplesHeader& h) { return h.both_sides ? json(member::both) : json(); },
     [](const json& v, SamplesHeader& h) {
       if (v != member::both) throw std::runtime_error("is not \"both\"");
       h.both_sides = true;
     }},
    {member::pairs, false, pairs_json, read_pairs},
    {names::part_yarns, true, yarns_json, read_yarns},
    {member::provenance, false, [](const SamplesHeader& h) { return provenance_json(h.provenance); },
     [](const json& v, SamplesHeader& h) { h.provenance = v.dump(); }},
}};

}  // namespace

std::vector<V3f> directions_of(const DirectionGrid& grid, bool both_sides) {
  std::vector<V3f> directions = directions_of(grid);
  for (int i = 0; both_sides && i < grid.count(); ++i) directions.push_back(mirrored(directions[i]));
  return directions;
}

const char* name_of(PairKind kind) { return pair_parts[index_of(kind)]; }

std::string samples_header_to_json(const SamplesHeader& header) {
  json text = json::object();
  for (const Field& field : fields) {
    json value = field.get(header);
    if (!value.is_null()) text[field.name] = std::move(value);
  }
  return text.dump();
}

Result<SamplesHeader> samples_header_from_json(const std::string& text, const std::string& file) {
  const auto refuse = [&](const std::string& place, std::string why) {
    return fail(Code::samples_malformed, file, names::attribute_samples + place, std::move(why));
  };
  const json members = parse_json(text);
  if (!members.is_object()) return refuse("", "is not a JSON object");
  SamplesHeader header;
  for (const Field& field : fields) {
    const std::string place = std::string("/") + field.name;
    const auto value = members.find(field.name);
    if (value == members.end()) {
      if (field.optional) continue;
      return refuse(place, "is missing");
    }
    try {
      field.set(*value, header);
    } catch (const std::exception& e) {
      return refuse(place, reason_of(e));
    }
  }
  return header;
}

}  // namespace selvedge
