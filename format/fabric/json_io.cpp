#include "format/fabric/json_io.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "format/base/json_text.h"
#include "format/fabric/names.h"

namespace selvedge {

using nlohmann::json;

void JsonIo::add_issue(std::string message) const { sink_->add(code_, place_, std::move(message)); }

void JsonIo::add_issue(const std::string& name, std::string message) const {
  sink_->add(code_, member_pointer(place_, name), std::move(message));
}

JsonIo JsonIo::member(const char* name) const {
  JsonIo result(nullptr, nullptr, member_pointer(place_, name), code_, sink_);
  if (from_ == nullptr) return result;
  if (const auto found = from_->find(name); found != from_->end())
    result.from_ = &*found;
  else
    result.add_issue("is missing");
  return result;
}

std::vector<JsonIo> JsonIo::items() const {
  std::vector<JsonIo> items;
  if (from_ != nullptr && !from_->is_array()) {
    add_issue("is not an array");
    return items;
  }
  for (std::size_t i = 0; from_ != nullptr && i < from_->size(); ++i)
    items.push_back({&(*from_)[i], nullptr, fmt::format("{}/{}", place_, i), code_, sink_});
  return items;
}

JsonIo JsonIo::object(const char* name) const {
  if (!is_reading()) return {nullptr, &((*to_)[name] = json::object()), {}, {}, nullptr};
  JsonIo result = member(name);
  if (!result || result.from_->is_object()) return result;
  result.add_issue("is not an object");
  result.from_ = nullptr;
  return result;
}

void JsonIo::read_whole(int& value, int min, int max) const {
  if (from_ == nullptr) return;
  if (!from_->is_number_integer())
    add_issue("is not a whole number");
  else if (*from_ < min || *from_ > max)
    add_issue(fmt::format("{} is outside of {} to {}", from_->dump(), min, max));
  else
    value = from_->get<int>();
}

void JsonIo::read_real(float& value, RealRule rule) const {
  if (from_ == nullptr) return;
  const double number = from_->is_number() ? from_->get<double>() : 0;
  if (!from_->is_number())
    add_issue("is not a number");
  else if (std::abs(number) > static_cast<double>(std::numeric_limits<float>::max()))
    add_issue("is beyond single precision");
  else if (rule == RealRule::positive && !(static_cast<float>(number) > 0))
    add_issue(fmt::format("{} is not positive", from_->dump()));
  else if (rule == RealRule::not_negative && number < 0)
    add_issue("is negative");
  else
    value = static_cast<float>(number);
}

void JsonIo::integer(const char* name, int& value, int min, int max) const {
  if (is_reading()) return member(name).read_whole(value, min, max);
  (*to_)[name] = value;
}

void JsonIo::number(const char* name, float& value, RealRule rule) const {
  if (is_reading()) return member(name).read_real(value, rule);
  (*to_)[name] = value;
}

std::vector<JsonIo> JsonIo::items(const char* name, std::size_t count) const {
  const std::size_t errors = sink_->error_count();
  std::vector<JsonIo> list = items(name);
  if (list.size() == count) return list;
  if (sink_->error_count() == errors)
    add_issue(name, fmt::format("does not have {} items", count == 2 ? "two" : "three"));
  return {};
}

void JsonIo::integer_pair(const char* name, int& first, int& second, int min, int max) const {
  if (!is_reading()) return set_member(name, {first, second});
  int* value = &first;
  for (const JsonIo& item : items(name, 2)) item.read_whole(*std::exchange(value, &second), min, max);
}

void JsonIo::numbers(const char* name, std::span<float> values, RealRule rule) const {
  if (!is_reading()) return set_member(name, values);
  auto value = values.begin();
  for (const JsonIo& item : items(name, values.size())) item.read_real(*value++, rule);
}

void JsonIo::increasing_integers(const char* name, std::vector<int>& list, int max) const {
  if (!is_reading()) return set_member(name, list);
  const std::size_t errors = sink_->error_count();
  for (const JsonIo& item : items(name)) {
    int number = -1;
    item.read_whole(number, 0, max);
    if (sink_->error_count() > errors) return;
    if (!list.empty() && number <= list.back())
      return item.add_issue(fmt::format("{} does not come after {}", number, list.back()));
    list.push_back(number);
  }
  if (list.empty() && sink_->error_count() == errors) add_issue(name, "is empty");
}

void JsonIo::strings(const char* name, std::vector<std::string>& list, std::size_t count) const {
  if (!is_reading()) return set_member(name, list);
  const std::size_t errors = sink_->error_count();
  const std::vector<JsonIo> all = items(name);
  if (all.size() != count && sink_->error_count() == errors)
    return add_issue(name, fmt::format("has {} items, the layer {} levels", all.size(), count));
  for (const JsonIo& item : all) {
    if (!item.value().is_string()) return item.add_issue("is not a string");
    list.push_back(item.value().get<std::string>());
  }
}

JsonIo JsonIo::grid(const char* name, DirectionGrid& grid, int max_directions) const {
  JsonIo text = object(name);
  if (!text) return text;
  const std::size_t errors = is_reading() ? sink_->error_count() : 0;
  if (!is_reading()) {
    text.set_member("layout", names::layout_equal_area);
  } else if (const JsonIo layout = text.member("layout");
             !layout || layout.value() != names::layout_equal_area) {
    const Code unknown = code_ == Code::fabric_member ? Code::fabric_unsupported : code_;
    if (layout && !layout.value().is_string())
      layout.add_issue("is not a string");
    else if (layout)
      sink_->add(unknown, layout.json_pointer(), "is not a known layout");
    return text;
  }
  text.integer("columns", grid.columns, 1, max_directions);
  text.integer("rows", grid.rows, 1, max_directions);
  if (is_reading() && sink_->error_count() == errors && grid.rows > max_directions / grid.columns)
    text.add_issue(fmt::format("{}x{} directions; {} are allowed", grid.columns, grid.rows, max_directions));
  return text;
}

void JsonIo::yarn_counts(YarnCounts& counts, const FabricLimits& limits) const {
  integer("curves", counts.curves, 1, limits.curves);
  integer("nodes", counts.nodes, 2, limits.nodes);
  integer("stations", counts.stations, 1, limits.stations);
  integer("fields", counts.values_per_curve, min_yarn_field_count, limits.values_per_curve);
  if (is_reading() && !input_has("valuesPerStation"))
    counts.values_per_station = min_station_value_count;
  else
    integer("valuesPerStation", counts.values_per_station, min_station_value_count,
            limits.values_per_station);
  if (!has_optional("packed", counts.light_functions > 0)) return;
  const JsonIo packed = object("packed");
  if (!packed) return;
  packed.integer("functions", counts.light_functions, 1, limits.functions);
  packed.number("step", counts.step, RealRule::positive);
}

json provenance_json(const std::string& provenance) {
  json parsed = parse_json(provenance);
  return parsed.is_object() ? parsed : json::object();
}

json short_number(double value, const char* form) {
  return parse_json(fmt::format(fmt::runtime(form), value));
}

}  // namespace selvedge
