#include "converter/presets/make_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <nlohmann/json.hpp>

#include "format/base/json_text.h"

namespace selvedge {
namespace {

using Json = nlohmann::json;

struct LayersValue {
  const char* name;
  bool view_table, budget;
  const char* option;  ///< of make
};
constexpr std::array<LayersValue, 3> layers_values{
    {{"paper", true, false, ""}, {"no-table", false, false, " --no-table"}, {"products", true, true, ""}}};

const LayersValue& layers_of(const MakeOptions& o) {
  return *std::find_if(layers_values.begin(), layers_values.end() - 1, [&](const LayersValue& v) {
    return v.budget == o.budget.has_value() && (v.budget || v.view_table == o.fit.view_table);
  });
}

struct StorageValue {
  const char* name;
  bool half_lobes, half_tables;
  const char* option;
};
constexpr std::array<StorageValue, 3> storage_values{{{"mixed", false, true, ""},
                                                      {"half", true, true, " --half-lobes"},
                                                      {"float", false, false, " --float-tables"}}};

const StorageValue& storage_of(const MakeOptions& o) {
  return *std::find_if(storage_values.begin(), storage_values.end() - 1, [&](const StorageValue& v) {
    return v.half_lobes == o.write.half.contains(LayerKind::lobes) &&
           v.half_tables == o.write.half.contains(LayerKind::table);
  });
}

template <class Values>
auto named(const Values& values, const Json& name) {
  return std::find_if(values.begin(), values.end(), [&](const auto& value) { return name == value.name; });
}

bool set_whole(const Json& value, int low, int high, int& knob) {
  if (!value.is_number_integer() || value < low || value > high) return false;
  knob = value.get<int>();
  return true;
}

struct Knob {
  const char* name;
  bool (*set)(const Json& value, MakeOptions& options);  ///< false if the value is not allowed
  Json (*get)(const MakeOptions& options);
};

bool set_layers(const Json& value, MakeOptions& o) {
  const auto* layers = named(layers_values, value);
  if (layers == layers_values.end()) return false;
  o.fit.view_table = layers->view_table;
  if (!layers->budget) o.budget.reset();
  if (layers->budget && !o.budget) o.budget = 0;
  return true;
}

bool set_storage(const Json& value, MakeOptions& o) {
  const auto* storage = named(storage_values, value);
  if (storage == storage_values.end()) return false;
  o.write.half = storage->half_tables ? table_layers : LayerSet();
  if (storage->half_lobes) o.write.half.insert(LayerKind::lobes);
  return true;
}

constexpr int max_directions = 4096;

const std::array<Knob, 10> all_knobs{
    {{"texels",
      [](const Json& v, MakeOptions& o) {
        return set_whole(v, 1, 4096, o.bake.width) && set_whole(v, 1, 4096, o.bake.height);
      },
      [](const MakeOptions& o) -> Json { return o.bake.width; }},
     {"views", [](const Json& v, MakeOptions& o) { return set_whole(v, 1, max_directions, o.bake.views); },
      [](const MakeOptions& o) -> Json { return o.bake.views; }},
     {"lights", [](const Json& v, MakeOptions& o) { return set_whole(v, 1, max_directions, o.bake.lights); },
      [](const MakeOptions& o) -> Json { return o.bake.lights; }},
     {"samples", [](const Json& v, MakeOptions& o) { return set_whole(v, 1, 1 << 20, o.bake.samples); },
      [](const MakeOptions& o) -> Json { return o.bake.samples; }},
     {"bounces",
      [](const Json& v, MakeOptions& o) {
        if (v != "unlimited") return set_whole(v, 0, 64, o.bake.bounces);
        o.bake.bounces = unlimited_bounces;
        return true;
      },
      [](const MakeOptions& o) -> Json {
        if (o.bake.bounces == unlimited_bounces) return "unlimited";
        return o.bake.bounces;
      }},
     {"lobes", [](const Json& v, MakeOptions& o) { return set_whole(v, 0, 16, o.fit.lobes); },
      [](const MakeOptions& o) -> Json { return o.fit.lobes; }},
     {"layers", set_layers, [](const MakeOptions& o) -> Json { return layers_of(o).name; }},
     {"budget",
      [](const Json& v, MakeOptions& o) {
        if (!v.is_number_integer() || v < 1) return false;
        o.budget = v.get<std::uint64_t>();
        return true;
      },
      [](const MakeOptions& o) -> Json { return o.budget ? Json(*o.budget) : Json(); }},
     {"storage", set_storage, [](const MakeOptions& o) -> Json { return storage_of(o).name; }},
     {"yarns",
      [](const Json& v, MakeOptions& o) {
        if (v.is_boolean()) o.bake.yarns = v.get<bool>();
        return v.is_boolean();
      },
      [](const MakeOptions& o) -> Json { return o.bake.yarns; }}}};

std::string text_of(const Json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

tl::unexpected<Error> refusal(const std::string& file, const std::string& place, const std::string& reason) {
  return tl::unexpected(Error{Code::option_out_of_range, file, place, reason});
}

bool has_budget(const Json& knobs) {
  const auto* layers = named(layers_values, knobs.value("layers", Json()));
  return layers != layers_values.end() && layers->budget;
}

/// What a grid gives a point beside its centre's knobs.
struct GridPoint {
  Json knobs;
  std::string object;  ///< JSON pointers: of the knobs, for messages about one of them
  std::string place;   ///< and of the point
  bool varied = false;
};

/// The parts of a grid in their order, the centre first.
Result<std::vector<GridPoint>> grid_points(const Json& grid, const std::string& file) {
  for (const auto& [key, value] : grid.items()) {
    if (key != "centre" && key != "vary" && key != "points")
      return refusal(file, pointer_to("", key), "is not a part of a grid");
  }
  std::vector<GridPoint> given{{grid.value("centre", Json::object()), "/centre", "/centre", false}};
  const Json vary = grid.value("vary", Json::object());
  if (!vary.is_object()) return refusal(file, "/vary", "is not an object");
  for (const auto& [knob, values] : vary.items()) {
    const std::string place = pointer_to("/vary", knob);
    if (!values.is_array()) return refusal(file, place, "is not an array");
    for (std::size_t i = 0; i < values.size(); ++i)
      given.push_back({{{knob, values[i]}}, "/vary", fmt::format("{}/{}", place, i), true});
  }
  const Json chosen = grid.value("points", Json::array());
  if (!chosen.is_array()) return refusal(file, "/points", "is not an array");
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const std::string place = fmt::format("/points/{}", i);
    given.push_back({chosen[i], place, place, false});
  }
  return given;
}

/// Refuses points that cannot be swept together.
Result<void> check_points(const std::vector<MakeOptions>& points, const std::string& file) {
  constexpr std::size_t max_points = 1000;
  if (points.size() > max_points)
    return refusal(file, "", fmt::format("{} points are more than {}", points.size(), max_points));
  int largest = 1;
  for (const MakeOptions& point : points) largest = std::max(largest, point.bake.width);
  for (const MakeOptions& point : points) {
    const int texels = point.bake.width;
    // The finest size has the held-out pairs, which are pooled for the others.
    if (largest % texels != 0 || !std::has_single_bit(static_cast<unsigned>(largest / texels)))
      return refusal(
          file, "",
          fmt::format("texels of the point {}: {} is not {} halved", settings_name(point), texels, largest));
    if (point.budget == 0)
      return refusal(
          file, "",
          fmt::format("the point {} has no budget to choose its layers within", settings_name(point)));
  }
  return {};
}

}  // namespace

double MakeOptions::budget_for(int texels) const {
  const double share = budget_texels > 0 ? static_cast<double>(texels) / budget_texels : 1;
  return static_cast<double>(*budget) * std::max(share, 1.0);
}

Result<void> set_knobs(const Json& knobs, const std::string& file, const std::string& place,
                       MakeOptions& options) {
  if (!knobs.is_object()) return refusal(file, place, "is not an object");
  if (knobs.contains("directions") && (knobs.contains("views") || knobs.contains("lights")))
    return refusal(file, pointer_to(place, "directions"),
                   "stands for views and lights, which are given beside it");
  for (const auto& [name, value] : knobs.items()) {
    bool known = false;
    for (const Knob& knob : all_knobs) {
      const bool both = name == "directions" &&
                        (knob.name == std::string_view("views") || knob.name == std::string_view("lights"));
      if (name != knob.name && !both) continue;
      known = true;
      if (!knob.set(value, options))
        return refusal(file, pointer_to(place, name),
                       fmt::format("{} is no value of it", value.dump().substr(0, 40)));
    }
    if (!known) return refusal(file, pointer_to(place, name), "is not a knob");
  }
  if (knobs.contains("budget") && !has_budget(knobs)) options.budget.reset();
  return {};
}

MakeOptions with_knobs(std::string_view knobs, MakeOptions options) {
  (void)set_knobs(Json::parse(knobs), "", "", options);
  return options;
}

nlohmann::ordered_json knobs_of(const MakeOptions& options) {
  nlohmann::ordered_json json;
  for (const Knob& knob : all_knobs) {
    if (const Json value = knob.get(options); !value.is_null()) json[knob.name] = value;
  }
  return json;
}

std::string options_text(const MakeOptions& options) {
  std::string text;
  for (const Knob& knob : all_knobs) {
    const Json value = knob.get(options);
    if (value == knob.get(MakeOptions())) continue;
    if (const auto* layers = named(layers_values, value); layers != layers_values.end()) {
      text += layers->option;
    } else if (const auto* storage = named(storage_values, value); storage != storage_values.end()) {
      text += storage->option;
    } else if (value.is_boolean()) {
      text += fmt::format(" --{} {}", knob.name, value.get<bool>() ? "on" : "off");
    } else {
      text += fmt::format(" --{} {}", knob.name, text_of(value));
    }
  }
  return text;
}

std::string bake_name(const MakeOptions& o) {
  const Json knobs = knobs_of(o);
  return fmt::format("t{}-v{}-l{}-s{}-b{}{}", o.bake.width, o.bake.views, o.bake.lights, o.bake.samples,
                     text_of(knobs["bounces"]), o.bake.yarns ? "-yarns" : "");
}

std::string settings_name(const MakeOptions& o) {
  return fmt::format("{}-{}-{}lobes{}-{}", bake_name(o), layers_of(o).name, o.fit.lobes,
                     o.budget ? fmt::format("-{}B", *o.budget) : "", storage_of(o).name);
}

Result<std::vector<MakeOptions>> read_grid(const std::string& text, const std::string& name) {
  const auto json = parse_json_object(text, name);
  if (!json) return tl::unexpected(json.error());
  const auto given = grid_points(*json, name);
  if (!given) return tl::unexpected(given.error());
  std::vector<MakeOptions> points;
  Json centre = Json::object();
  for (const GridPoint& part : *given) {
    MakeOptions options;
    if (auto ok = set_knobs(part.knobs, name, part.object, options); !ok) return tl::unexpected(ok.error());
    Json knobs = centre;
    knobs.update(part.knobs);
    if (knobs.contains("directions")) {
      knobs["views"] = knobs["lights"] = knobs["directions"];
      knobs.erase("directions");
    }
    if (points.empty()) {
      centre = knobs;
    } else if (part.knobs.contains("budget") && !has_budget(knobs)) {
      return refusal(
          name, part.object + "/budget",
          fmt::format("counts for nothing with layers {}", text_of(knobs.value("layers", Json("paper")))));
    }
    options = with_knobs(knobs.dump());
    const auto is_same = [&](const MakeOptions& other) {
      return settings_name(other) == settings_name(options);
    };
    // The centre's values may be varied, too.
    if (part.varied && is_same(points.front())) continue;
    if (std::any_of(points.begin(), points.end(), is_same))
      return refusal(name, part.place, "is a point already");
    points.push_back(std::move(options));
  }
  const auto chooses = [](const MakeOptions& point) { return point.budget.has_value(); };
  if (centre.contains("budget") && std::none_of(points.begin(), points.end(), chooses))
    return refusal(name, "/centre/budget", "counts for nothing: no point chooses its layers within it");
  if (auto ok = check_points(points, name); !ok) return tl::unexpected(ok.error());
  return points;
}

}  // namespace selvedge
