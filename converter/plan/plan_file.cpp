#include "converter/plan/plan_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "format/base/atomic_file.h"
#include "format/base/json_text.h"

namespace selvedge {
namespace {

using Json = nlohmann::ordered_json;

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(); }

/// A number >= 0; null stands for infinity.
std::optional<double> length_of(const nlohmann::json& value) {
  if (value.is_null()) return HUGE_VAL;
  if (!value.is_number()) return std::nullopt;
  const double number = value.get<double>();
  if (!(number >= 0)) return std::nullopt;
  return number;
}

Result<TexelDemand> demand_of(const std::string& path, const std::string& place,
                              const nlohmann::json& material, double bias) {
  const auto found = material.find("pixelMm");
  if (found == material.end() || !found->is_array() || found->size() != 2)
    return fail(Code::json_malformed, path, place + "/pixelMm", "is not an array of two lengths");
  const auto min_mm = length_of((*found)[0]);
  const auto max_mm = length_of((*found)[1]);
  if (!min_mm || !max_mm)
    return fail(Code::json_malformed, path, place + "/pixelMm", "is not an array of two lengths");
  const bool is_unseen = std::isinf(*min_mm);
  if (*min_mm > *max_mm && !(is_unseen && *max_mm == 0))
    return fail(Code::json_malformed, path, place + "/pixelMm", "has a minimum above its maximum");
  const auto seen = material.find("seen");
  if (seen != material.end() && (!seen->is_boolean() || seen->get<bool>() == is_unseen))
    return fail(Code::json_malformed, path, place + "/seen", "does not go with pixelMm");
  const auto backs = material.find("backs");
  if (backs != material.end() && !backs->is_boolean())
    return fail(Code::json_malformed, path, place + "/backs", "is neither true nor false");
  return TexelDemand{*min_mm, *max_mm, bias, backs != material.end() && backs->get<bool>()};
}

/// Levels are not used, but impossible ones show that the file is not a plan.
Result<void> check_levels(const std::string& path, const std::string& place, const nlohmann::json& material) {
  const auto levels = material.find("levels");
  if (levels == material.end()) return {};
  const auto is_level = [](const nlohmann::json& level) { return level.is_number_unsigned(); };
  if (!levels->is_array() || levels->size() != 2 || !std::all_of(levels->begin(), levels->end(), is_level))
    return fail(Code::json_malformed, path, place + "/levels", "is not an array of two levels");
  if ((*levels)[0] > (*levels)[1])
    return fail(Code::json_malformed, path, place + "/levels", "has the coarsest before the finest");
  const auto all = material.find("levelsOfFabric");
  if (all != material.end() && !(is_level(*all) && *all > (*levels)[1]))
    return fail(Code::json_malformed, path, place + "/levelsOfFabric", "does not go with levels");
  return {};
}

/// Exactly the options that the plan depends on.
Json sight_json(const PlanOptions& o) {
  const CameraOptions& camera = o.camera;
  Json sight = Json::object();
  if (!o.choice.scene.empty()) sight["scene"] = o.choice.scene;
  if (!o.choice.variant.empty()) sight["variant"] = o.choice.variant;
  if (!o.cameras.empty()) sight["cameras"] = o.cameras;
  if (o.distances) sight["distances"] = {o.distances->x, o.distances->y};
  const bool single = o.cameras.empty() && !o.distances;
  if (single) {
    sight["azimuth"] = camera.azimuth;
    sight["elevation"] = camera.elevation;
    if (camera.look_at) sight["lookAt"] = {camera.look_at->x, camera.look_at->y, camera.look_at->z};
    if (camera.distance)
      sight["distance"] = *camera.distance;
    else
      sight["distanceFactor"] = camera.distance_factor;
  }
  if (single || o.distances) {
    const bool perspective = camera.projection == Projection::perspective;
    sight["projection"] = perspective ? "perspective" : "parallel";
    // A parallel camera that shows everything has no distance.
    if (perspective || camera.distance || o.distances) sight["fov"] = camera.field_of_view;
  }
  sight["zoom"] = camera.zoom;
  sight["focus"] = {camera.focus.x, camera.focus.y};
  return sight;
}

bool matches(const nlohmann::json& material, const std::string& selector) {
  const auto name = material.find("name");
  if (name != material.end() && name->is_string() && name->get<std::string>() == selector) return true;
  const auto index = material.find("index");
  return index != material.end() && index->is_number_integer() &&
         fmt::format("#{}", index->dump()) == selector;
}

}  // namespace

Json plan_json(const ScenePlan& plan) {
  const PlanOptions& o = plan.options;
  Json materials = Json::array();
  for (const MaterialPlan& m : plan.materials) {
    materials.push_back({{"index", m.index},
                         {"name", m.name},
                         {"fabric", m.fabric},
                         {"mmPerRepeat", {m.mm_per_repeat.x, m.mm_per_repeat.y}},
                         {"texels", {m.texels.x, m.texels.y}},
                         {"seen", m.seen},
                         {"levels", {m.levels.first, m.levels.last}},
                         {"levelsOfFabric", m.whole_levels},
                         {"lacking", {m.lacking.finer, m.lacking.coarser}},
                         {"pixelMm", {number_or_null(m.demand.min_mm), number_or_null(m.demand.max_mm)}},
                         {"texelMm", number_or_null(m.demand.min_mm * std::exp2(m.demand.bias))},
                         {"fronts", m.fronts},
                         {"backs", m.backs},
                         {"holes", m.holes},
                         {"behind", m.behind}});
  }
  return {{"scene", plan.scene},
          {"size", {o.size.x, o.size.y}},
          {"supersample", o.supersample},
          {"sight", sight_json(o)},
          {"look", {{"bias", o.levels.bias}, {"blend", o.levels.blend}, {"area", o.levels.area}}},
          {"materials", materials}};
}

Result<TexelDemand> read_plan(const std::string& path, const std::vector<std::string>& materials) {
  constexpr std::uintmax_t longest_file = std::uintmax_t{1} << 28;
  const auto text = read_file(path, longest_file);
  if (!text) return tl::unexpected(text.error());
  const auto read = parse_json_object(*text, path);
  if (!read) return tl::unexpected(read.error());
  const nlohmann::json& plan = *read;
  const auto refuse = [&](const char* place, const char* why) {
    return fail(Code::json_malformed, path, place, why);
  };
  if (plan.value("verb", nlohmann::json()) != "plan") return refuse("/verb", "is not \"plan\"");
  if (plan.value("program", nlohmann::json("selvedge")) != "selvedge")
    return refuse("/program", "is not \"selvedge\"");
  if (plan.value("report", nlohmann::json(1)) != 1) return refuse("/report", "is not 1");
  const auto look = plan.find("look");
  const bool has_bias = look != plan.end() && look->is_object() && look->contains("bias") &&
                        look->at("bias").is_number() && std::abs(look->at("bias").get<double>()) <= 32;
  if (!has_bias) return refuse("/look/bias", "is not a number of levels");
  const auto list = plan.find("materials");
  if (list == plan.end() || !list->is_array() || list->empty())
    return refuse("/materials", "is not an array of materials");
  TexelDemand all{HUGE_VAL, 0, look->at("bias").get<double>()};
  std::vector<bool> found(materials.size(), false);
  for (std::size_t i = 0; i < list->size(); ++i) {
    const nlohmann::json& material = (*list)[i];
    const std::string place = fmt::format("/materials/{}", i);
    if (!material.is_object()) return fail(Code::json_malformed, path, place, "is not an object");
    bool meant = materials.empty();
    for (std::size_t k = 0; k < materials.size(); ++k) {
      if (!matches(material, materials[k])) continue;
      meant = found[k] = true;
    }
    if (!meant) continue;
    if (auto good = check_levels(path, place, material); !good) return tl::unexpected(good.error());
    auto one = demand_of(path, place, material, all.bias);
    if (!one) return one;
    all.min_mm = std::min(all.min_mm, one->min_mm);
    all.max_mm = std::max(all.max_mm, one->max_mm);
    all.backs = all.backs || one->backs;
  }
  for (std::size_t k = 0; k < materials.size(); ++k) {
    if (found[k]) continue;
    return fail(Code::material_missing, path, "--material",
                fmt::format("the plan has no material \"{}\"", materials[k]));
  }
  return all;
}

}  // namespace selvedge
