#include "converter/presets/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>

#include "format/base/json_text.h"

namespace selvedge {
namespace {

using Json = nlohmann::json;

constexpr std::array<const char*, 5> layer_names{"paper", "no-table", "light-table", "products", "slabs"};
constexpr std::array<const char*, 3> storage_names{"mixed", "half", "float"};

const char* name_of(LayerChoice layers) { return layer_names[static_cast<std::size_t>(layers)]; }
const char* name_of(Storage storage) { return storage_names[static_cast<std::size_t>(storage)]; }

std::string bounces_text(int bounces) {
  return bounces == unlimited_bounces ? "unlimited" : fmt::format("{}", bounces);
}

/// Gives the knob its value; false where the value is none for it.
using Knob = std::function<bool(const Json&, TradePoint&)>;

Knob whole(int TradePoint::*member, int least, int most) {
  return [=](const Json& value, TradePoint& point) {
    if (!value.is_number_integer() || value < least || value > most) return false;
    point.*member = value.get<int>();
    return true;
  };
}

template <class Choice, std::size_t n>
Knob one_of(Choice TradePoint::*member, const std::array<const char*, n>& names) {
  return [member, &names](const Json& value, TradePoint& point) {
    for (std::size_t i = 0; i < n; ++i) {
      if (value != names[i]) continue;
      point.*member = static_cast<Choice>(i);
      return true;
    }
    return false;
  };
}

const std::map<std::string, Knob>& knobs() {
  static const std::map<std::string, Knob> all{{"texels", whole(&TradePoint::texels, 1, 4096)},
                                               {"views", whole(&TradePoint::views, 1, 4096)},
                                               {"lights", whole(&TradePoint::lights, 1, 4096)},
                                               {"directions",
                                                [](const Json& value, TradePoint& point) {
                                                  return whole(&TradePoint::views, 1, 4096)(value, point) &&
                                                         whole(&TradePoint::lights, 1, 4096)(value, point);
                                                }},
                                               {"samples", whole(&TradePoint::samples, 1, 1 << 20)},
                                               {"bounces",
                                                [](const Json& value, TradePoint& point) {
                                                  if (value != "unlimited")
                                                    return whole(&TradePoint::bounces, 0, 64)(value, point);
                                                  point.bounces = unlimited_bounces;
                                                  return true;
                                                }},
                                               {"lobes", whole(&TradePoint::lobes, 0, 16)},
                                               {"layers", one_of(&TradePoint::layers, layer_names)},
                                               {"budget",
                                                [](const Json& value, TradePoint& point) {
                                                  if (!value.is_number_integer() || value < 1) return false;
                                                  point.budget = value.get<std::uint64_t>();
                                                  return true;
                                                }},
                                               {"storage", one_of(&TradePoint::storage, storage_names)}};
  return all;
}

Result<void> refuse(const std::string& file, const std::string& place, const std::string& reason) {
  return fail(Code::option_out_of_range, file, place, reason);
}

Result<void> set_knob(const std::string& file, const std::string& place, const std::string& name,
                      const Json& value, TradePoint& point) {
  const auto knob = knobs().find(name);
  if (knob == knobs().end()) return refuse(file, place, "is not a knob");
  if (knob->second(value, point)) return {};
  return refuse(file, place, fmt::format("{} is no value of it", value.dump().substr(0, 40)));
}

Result<TradePoint> knobs_from(const std::string& file, const std::string& place, const Json& json,
                              TradePoint point) {
  if (!json.is_object()) return tl::unexpected(refuse(file, place, "is not an object").error());
  for (const auto& [name, value] : json.items()) {
    if (auto ok = set_knob(file, pointer_to(place, name), name, value, point); !ok)
      return tl::unexpected(ok.error());
    if (name == "directions" && (json.contains("views") || json.contains("lights")))
      return tl::unexpected(
          refuse(file, pointer_to(place, name), "stands for views and lights, which are given beside it")
              .error());
  }
  return point;
}

/// The point as the sweep knows it: a budget that does not count must not tell two of them apart.
TradePoint plain(TradePoint point) {
  if (!has_budget(point)) point.budget = 0;
  return point;
}

/// The centre and the values of "vary". A value that is the centre's adds nothing; one that is there twice is
/// refused.
Result<std::vector<TradePoint>> vary_around(const std::string& file, const TradePoint& centre,
                                            const Json& vary) {
  std::vector<TradePoint> points{plain(centre)};
  if (!vary.is_object()) return tl::unexpected(refuse(file, "/vary", "is not an object").error());
  for (const auto& [knob, values] : vary.items()) {
    const std::string place = pointer_to("/vary", knob);
    if (!values.is_array()) return tl::unexpected(refuse(file, place, "is not an array").error());
    if (knob == "budget" && !has_budget(centre))
      return tl::unexpected(
          refuse(file, place, fmt::format("counts for nothing with layers {}", name_of(centre.layers)))
              .error());
    for (std::size_t i = 0; i < values.size(); ++i) {
      TradePoint point = centre;
      if (auto ok = set_knob(file, place, knob, values[i], point); !ok) return tl::unexpected(ok.error());
      point = plain(point);
      if (point == points.front()) continue;
      if (std::find(points.begin(), points.end(), point) != points.end())
        return tl::unexpected(refuse(file, fmt::format("{}/{}", place, i), "is a point already").error());
      points.push_back(point);
    }
  }
  return points;
}

Result<void> add_points(const std::string& file, const TradePoint& centre, const Json& chosen,
                        std::vector<TradePoint>& points) {
  if (!chosen.is_array()) return refuse(file, "/points", "is not an array");
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const std::string place = fmt::format("/points/{}", i);
    const auto read = knobs_from(file, place, chosen[i], centre);
    if (!read) return tl::unexpected(read.error());
    if (chosen[i].contains("budget") && !has_budget(*read))
      return refuse(file, place + "/budget",
                    fmt::format("counts for nothing with layers {}", name_of(read->layers)));
    const TradePoint point = plain(*read);
    if (std::find(points.begin(), points.end(), point) != points.end())
      return refuse(file, place, "is a point already");
    points.push_back(point);
  }
  return {};
}

/// Pictures are judged at the finest size: the others must halve it.
Result<void> check_points(const std::string& file, const std::vector<TradePoint>& points) {
  constexpr std::size_t max_points = 1000;
  if (points.size() > max_points)
    return refuse(file, "", fmt::format("{} points are more than {}", points.size(), max_points));
  int largest = 1;
  for (const TradePoint& point : points) largest = std::max(largest, point.texels);
  for (const TradePoint& point : points) {
    int size = largest;
    while (size > point.texels && size % 2 == 0) size /= 2;
    if (size != point.texels) {
      return refuse(
          file, "",
          fmt::format("texels of the point {}: {} is not {} halved", name_of(point), point.texels, largest));
    }
    if (has_budget(point) && point.budget == 0)
      return refuse(file, "",
                    fmt::format("the point {} has no budget to choose its layers within", name_of(point)));
  }
  return {};
}

}  // namespace

bool has_budget(const TradePoint& p) {
  return p.layers == LayerChoice::products || p.layers == LayerChoice::slabs;
}

std::string bake_name_of(const TradePoint& p) {
  return fmt::format("t{}-v{}-l{}-s{}-b{}{}", p.texels, p.views, p.lights, p.samples, bounces_text(p.bounces),
                     p.layers == LayerChoice::slabs ? "-slabs" : "");
}

std::string name_of(const TradePoint& p) {
  // A choice within a budget makes use of what lobes a level needs.
  std::string name = fmt::format("{}-{}-{}lobes", bake_name_of(p), name_of(p.layers), p.lobes);
  if (has_budget(p)) name += fmt::format("-{}B", p.budget);
  return fmt::format("{}-{}", name, name_of(p.storage));
}

std::string options_text(const TradePoint& p) {
  const TradePoint usual;
  std::string text;
  const auto add_number = [&](const char* option, int value, int of_usual) {
    if (value != of_usual) text += fmt::format(" {} {}", option, value);
  };
  add_number("--texels", p.texels, usual.texels);
  add_number("--views", p.views, usual.views);
  add_number("--lights", p.lights, usual.lights);
  add_number("--samples", p.samples, usual.samples);
  if (p.bounces != usual.bounces) text += " --bounces " + bounces_text(p.bounces);
  add_number("--lobes", p.lobes, usual.lobes);
  if (p.layers == LayerChoice::no_table) text += " --no-table";
  if (p.layers == LayerChoice::light_table) text += " --light-table";
  if (p.layers == LayerChoice::slabs) text += " --slabs 1";
  if (has_budget(p)) text += fmt::format(" --budget {}", p.budget);
  if (p.storage == Storage::half) text += " --half-lobes";
  if (p.storage == Storage::whole) text += " --float-tables";
  return text;
}

std::string knobs_json(const TradePoint& p) {
  nlohmann::ordered_json json = {
      {"texels", p.texels}, {"views", p.views}, {"lights", p.lights}, {"samples", p.samples}};
  if (p.bounces == unlimited_bounces) {
    json["bounces"] = "unlimited";
  } else {
    json["bounces"] = p.bounces;
  }
  json["lobes"] = p.lobes;
  json["layers"] = name_of(p.layers);
  if (has_budget(p)) json["budget"] = p.budget;
  json["storage"] = name_of(p.storage);
  return json.dump();
}

BakeOptions bake_options_of(const TradePoint& p, std::uint64_t seed) {
  BakeOptions bake;
  bake.width = bake.height = p.texels;
  bake.views = p.views;
  bake.lights = p.lights;
  bake.samples = p.samples;
  bake.bounces = p.bounces;
  bake.slabs = p.layers == LayerChoice::slabs ? 1 : 0;
  bake.seed = seed;
  return bake;
}

TradeFit fit_options_of(const TradePoint& p) {
  TradeFit options;
  options.fit.lobes = p.lobes;
  options.fit.view_table = p.layers != LayerChoice::no_table;
  options.fit.light_table = p.layers == LayerChoice::light_table;
  if (p.storage == Storage::half) options.write.half.insert(Layer::lobes);
  if (p.storage == Storage::whole) options.write.half.erase(table_layers);
  return options;
}

std::vector<TradePoint> default_grid() {
  static constexpr const char* text = R"({
    "vary": {
      "texels": [8, 16, 64],
      "directions": [16, 36, 144],
      "views": [16, 144],
      "samples": [1, 2, 32],
      "bounces": [0, 1, 8],
      "lobes": [1, 3, 4],
      "layers": ["no-table", "light-table"],
      "storage": ["half", "float"]
    },
    "points": [
      {"layers": "products", "budget": 65536}, {"layers": "products", "budget": 524288},
      {"layers": "slabs", "budget": 65536}, {"layers": "slabs", "budget": 524288},
      {"texels": 8, "directions": 16, "samples": 2, "bounces": 0, "lobes": 1, "storage": "half"},
      {"texels": 16, "directions": 16, "samples": 4, "bounces": 1, "lobes": 1, "storage": "half"},
      {"texels": 16, "directions": 36, "samples": 4, "storage": "half"},
      {"texels": 16, "directions": 36, "layers": "slabs", "budget": 65536},
      {"texels": 64, "directions": 36, "samples": 4},
      {"texels": 64, "directions": 36, "samples": 4, "layers": "slabs", "budget": 1048576},
      {"directions": 144, "layers": "slabs", "budget": 1048576}
    ]
  })";
  return *read_grid(text, "the default grid");
}

Result<std::vector<TradePoint>> read_grid(const std::string& text, const std::string& name) {
  auto read = parse_json_object(text, name);
  if (!read) return tl::unexpected(read.error());
  const Json json = std::move(*read);
  for (const auto& [key, value] : json.items()) {
    if (key != "centre" && key != "vary" && key != "points")
      return tl::unexpected(refuse(name, pointer_to("", key), "is not a part of a grid").error());
  }
  const auto centre = knobs_from(name, "/centre", json.value("centre", Json::object()), TradePoint());
  if (!centre) return tl::unexpected(centre.error());
  auto points = vary_around(name, *centre, json.value("vary", Json::object()));
  if (!points) return points;
  if (auto ok = add_points(name, *centre, json.value("points", Json::array()), *points); !ok)
    return tl::unexpected(ok.error());
  if (centre->budget > 0 && std::none_of(points->begin(), points->end(), has_budget))
    return tl::unexpected(
        refuse(name, "/centre/budget", "counts for nothing: no point chooses its layers within it").error());
  if (auto ok = check_points(name, *points); !ok) return tl::unexpected(ok.error());
  return points;
}

}  // namespace selvedge
