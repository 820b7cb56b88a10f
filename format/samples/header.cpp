#include "format/samples/header.h"

#include <fmt/format.h>

#include <algorithm>
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

constexpr ByPairKind<const char*> pair_parts{names::part_validation, names::part_held_out, names::part_rim,
                                             names::part_measured};

json list_of(const V3f& v) { return {v.x, v.y, v.z}; }

/// A grid with its directions, which are informative.
json grid_with_directions(const DirectionGrid& grid) {
  json directions = json::array();
  for (const V3f& d : directions_of(grid)) directions.push_back(list_of(d));
  json result = grid_json(grid);
  result[member::directions] = directions;
  return result;
}

/// A unit vector, of the upper hemisphere unless both sides are known.
V3f direction_from(const json& list, bool both_sides) {
  const V3f v(list.at(0).get<float>(), list.at(1).get<float>(), list.at(2).get<float>());
  if (!(std::abs(v.length() - 1) < 1e-3F) || !(v.z >= 0 || both_sides))
    throw std::runtime_error("pairs: not a unit direction above the cloth");
  return v;
}

int whole_from(const json& number, const char* name) {
  constexpr std::int64_t limit = std::numeric_limits<int>::max();
  if (!number.is_number_integer() || number < 0 || number > limit) {
    throw std::runtime_error(fmt::format("{}: not a whole number", name));
  }
  return number.get<int>();
}

float length_from(const json& number, const char* name, bool may_be_zero) {
  const auto length = number.get<float>();
  if (!std::isfinite(length) || length < 0 || (length == 0 && !may_be_zero)) {
    throw std::runtime_error(fmt::format("{}: not a length", name));
  }
  return length;
}

DirectionGrid views_or_lights(const json& text, const char* name) {
  const auto grid = grid_from_json(text.at(name), FabricLimits{}.directions);
  if (!grid) throw std::runtime_error(name + grid.error().place + ": " + grid.error().message);
  return *grid;
}

int count_from(const json& text, const char* name, int max) {
  const int value = whole_from(text.at(name), name);
  if (value < 1 || value > max) throw std::runtime_error(fmt::format("{}: not 1 to {}", name, max));
  return value;
}

YarnCounts yarns_from(const json& text) {
  const FabricLimits limits;
  YarnCounts counts{count_from(text, member::curves, limits.curves),
                    count_from(text, member::nodes, limits.nodes),
                    count_from(text, member::stations, limits.stations)};
  if (text.contains(member::fields)) counts.fields = count_from(text, member::fields, limits.fields);
  if (counts.fields < fields_of_round_yarn) throw std::runtime_error("fields: too few");
  return counts;
}

/// Throws if a member breaks a rule; the caller converts the exception to an error.
SamplesHeader header_from(const json& text) {
  SamplesHeader header;
  if (const json& version = text.at(member::version); version != names::samples_version) {
    throw std::runtime_error(fmt::format("version {} is not understood; this program reads version {}",
                                         version.dump(), names::samples_version));
  }
  header.width = whole_from(text.at(member::texels).at(0), member::texels);
  header.height = whole_from(text.at(member::texels).at(1), member::texels);
  const int limit = FabricLimits{}.texels_per_side;
  if (header.width < 1 || header.height < 1 || header.width > limit || header.height > limit) {
    throw std::runtime_error(fmt::format("texels: not 1 to {} a side", limit));
  }
  header.period_mm = {length_from(text.at(member::mm_per_repeat).at(0), member::mm_per_repeat, false),
                      length_from(text.at(member::mm_per_repeat).at(1), member::mm_per_repeat, false)};
  header.reference_height = text.at(member::reference_height).get<float>();
  if (!std::isfinite(header.reference_height)) throw std::runtime_error("referenceHeight: not finite");
  header.thickness_mm = length_from(text.at(member::thickness), member::thickness, true);
  header.views = views_or_lights(text, member::views);
  header.lights = views_or_lights(text, member::lights);
  header.samples_per_texel = whole_from(text.at(member::samples_per_texel), member::samples_per_texel);
  header.truth_samples = whole_from(text.at(member::truth_samples), member::truth_samples);
  if (text.contains(member::sides)) {
    if (text.at(member::sides) != member::both) throw std::runtime_error("sides: not both");
    header.both_sides = true;
  }
  for (const PairKind kind : all_pair_kinds) {
    const json& sets = text.at(member::pairs);
    if (kind == PairKind::measured && !sets.contains(name_of(kind))) continue;
    for (const json& pair : sets.at(name_of(kind))) {
      header.pairs[index_of(kind)].push_back({direction_from(pair.at(member::light), header.both_sides),
                                              direction_from(pair.at(member::view), header.both_sides)});
    }
  }
  if (text.contains(member::whole)) {
    const json& whole = text.at(member::whole);
    const json& texels = whole.at(member::texels);
    header.whole =
        WholeFabric{V2i(whole_from(texels.at(0), member::whole), whole_from(texels.at(1), member::whole)),
                    whole_from(whole.at(member::level), member::whole)};
    if (std::max(header.whole->texels.x, header.whole->texels.y) > limit || header.whole->level < 1 ||
        !is_level_of(*header.whole, header.width, header.height)) {
      throw std::runtime_error("whole: the texels are those of no level of it");
    }
  }
  if (text.contains(names::part_yarns)) header.yarns = yarns_from(text.at(names::part_yarns));
  header.provenance = text.at(member::provenance).dump();
  return header;
}

}  // namespace

std::vector<V3f> directions_of(const DirectionGrid& grid, bool both_sides) {
  std::vector<V3f> directions = directions_of(grid);
  for (int i = 0; both_sides && i < grid.count(); ++i) directions.push_back(mirrored(directions[i]));
  return directions;
}

const char* name_of(PairKind kind) { return pair_parts[index_of(kind)]; }

std::string samples_header_to_json(const SamplesHeader& header) {
  json pairs = json::object();
  for (const PairKind kind : all_pair_kinds) {
    if (kind == PairKind::measured && header.pairs[index_of(kind)].empty()) continue;
    json list = json::array();
    for (const DirectionPair& pair : header.pairs[index_of(kind)]) {
      list.push_back({{member::light, list_of(pair.light)}, {member::view, list_of(pair.view)}});
    }
    pairs[pair_parts[index_of(kind)]] = list;
  }
  json text{
      {member::version, names::samples_version},
      {member::texels, {header.width, header.height}},
      {member::mm_per_repeat, {header.period_mm.x, header.period_mm.y}},
      {member::reference_height, header.reference_height},
      {member::thickness, header.thickness_mm},
      {member::views, grid_with_directions(header.views)},
      {member::lights, grid_with_directions(header.lights)},
      {member::samples_per_texel, header.samples_per_texel},
      {member::truth_samples, header.truth_samples},
      {member::pairs, pairs},
      {member::provenance, provenance_json(header.provenance)},
  };
  if (header.yarns.curves > 0) {
    text[names::part_yarns] = {{member::curves, header.yarns.curves},
                               {member::nodes, header.yarns.nodes},
                               {member::stations, header.yarns.stations}};
    if (header.yarns.fields > fields_of_round_yarn)
      text[names::part_yarns][member::fields] = header.yarns.fields;
  }
  if (header.both_sides) text[member::sides] = member::both;
  if (header.whole) text[member::whole] = whole_json(*header.whole);
  return text.dump();
}

Result<SamplesHeader> samples_header_from_json(const std::string& text, const std::string& file) {
  const json members = parse_json(text);
  if (!members.is_object())
    return fail(Code::samples_malformed, file, names::attribute_samples, "is not a JSON object");
  try {
    return header_from(members);
  } catch (const std::exception& e) {
    return fail(Code::samples_malformed, file, names::attribute_samples, reason_of(e));
  }
}

}  // namespace selvedge
