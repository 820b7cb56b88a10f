#include "format/fabric/json_io.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "format/base/json_text.h"
#include "format/fabric/names.h"

namespace selvedge {

using nlohmann::json;

void JsonIo::refuse(std::string message) const { sink_->add(code_, place_, std::move(message)); }

void JsonIo::refuse(const std::string& name, std::string message) const {
  sink_->add(code_, pointer_to(place_, name), std::move(message));
}

JsonIo JsonIo::member(const char* name) const {
  JsonIo result(nullptr, nullptr, pointer_to(place_, name), code_, sink_);
  if (from_ == nullptr) return result;
  if (const auto found = from_->find(name); found != from_->end())
    result.from_ = &*found;
  else
    result.refuse("is missing");
  return result;
}

std::vector<JsonIo> JsonIo::items() const {
  std::vector<JsonIo> items;
  if (from_ != nullptr && !from_->is_array()) {
    refuse("is not an array");
    return items;
  }
  for (std::size_t i = 0; from_ != nullptr && i < from_->size(); ++i)
    items.push_back({&(*from_)[i], nullptr, fmt::format("{}/{}", place_, i), code_, sink_});
  return items;
}

JsonIo JsonIo::object(const char* name) const {
  if (!reads()) return {nullptr, &((*to_)[name] = json::object()), {}, {}, nullptr};
  JsonIo result = member(name);
  if (!result || result.from_->is_object()) return result;
  result.refuse("is not an object");
  result.from_ = nullptr;
  return result;
}

void JsonIo::read_whole(int& value, int min, int max) const {
  if (from_ == nullptr) return;
  if (!from_->is_number_integer())
    refuse("is not a whole number");
  else if (*from_ < min || *from_ > max)
    refuse(fmt::format("{} is outside of {} to {}", from_->dump(), min, max));
  else
    value = from_->get<int>();
}

void JsonIo::read_real(float& value, RealRule rule) const {
  if (from_ == nullptr) return;
  const double number = from_->is_number() ? from_->get<double>() : 0;
  if (!from_->is_number())
    refuse("is not a number");
  else if (std::abs(number) > static_cast<double>(std::numeric_limits<float>::max()))
    refuse("is beyond single precision");
  else if (rule == RealRule::positive && !(static_cast<float>(number) > 0))
    refuse(fmt::format("{} is not positive", from_->dump()));
  else if (rule == RealRule::not_negative && number < 0)
    refuse("is negative");
  else
    value = static_cast<float>(number);
}

void JsonIo::whole(const char* name, int& value, int min, int max) const {
  if (reads()) return member(name).read_whole(value, min, max);
  (*to_)[name] = value;
}

void JsonIo::real(const char* name, float& value, RealRule rule) const {
  if (reads()) return member(name).read_real(value, rule);
  (*to_)[name] = value;
}

std::vector<JsonIo> JsonIo::items(const char* name, std::size_t count) const {
  const std::size_t errors = sink_->errors();
  std::vector<JsonIo> list = items(name);
  if (list.size() == count) return list;
  if (sink_->errors() == errors)
    refuse(name, fmt::format("does not have {} items", count == 2 ? "two" : "three"));
  return {};
}

void JsonIo::wholes(const char* name, int& first, int& second, int min, int max) const {
  if (!reads()) return set(name, {first, second});
  int* value = &first;
  for (const JsonIo& item : items(name, 2)) item.read_whole(*std::exchange(value, &second), min, max);
}

void JsonIo::reals(const char* name, std::span<float> values, RealRule rule) const {
  if (!reads()) return set(name, values);
  auto value = values.begin();
  for (const JsonIo& item : items(name, values.size())) item.read_real(*value++, rule);
}

void JsonIo::increasing(const char* name, std::vector<int>& list, int max) const {
  if (!reads()) return set(name, list);
  const std::size_t errors = sink_->errors();
  for (const JsonIo& item : items(name)) {
    int number = -1;
    item.read_whole(number, 0, max);
    if (sink_->errors() > errors) return;
    if (!list.empty() && number <= list.back())
      return item.refuse(fmt::format("{} does not come after {}", number, list.back()));
    list.push_back(number);
  }
  if (list.empty() && sink_->errors() == errors) refuse(name, "is empty");
}

void JsonIo::texts(const char* name, std::vector<std::string>& list, std::size_t count) const {
  if (!reads()) return set(name, list);
  const std::size_t errors = sink_->errors();
  const std::vector<JsonIo> all = items(name);
  if (all.size() != count && sink_->errors() == errors)
    return refuse(name, fmt::format("has {} items, the layer {} levels", all.size(), count));
  for (const JsonIo& item : all) {
    if (!item.value().is_string()) return item.refuse("is not a string");
    list.push_back(item.value().get<std::string>());
  }
}

JsonIo JsonIo::grid(const char* name, DirectionGrid& grid, int max_directions) const {
  JsonIo text = object(name);
  if (!text) return text;
  const std::size_t errors = reads() ? sink_->errors() : 0;
  if (!reads()) {
    text.set(names::member::layout, names::layout_equal_area);
  } else if (const JsonIo layout = text.member(names::member::layout);
             !layout || layout.value() != names::layout_equal_area) {
    const Code unknown = code_ == Code::fabric_member ? Code::fabric_unsupported : code_;
    if (layout && !layout.value().is_string())
      layout.refuse("is not a string");
    else if (layout)
      sink_->add(unknown, layout.place(), "is not a known layout");
    return text;
  }
  text.whole(names::member::columns, grid.columns, 1, max_directions);
  text.whole(names::member::rows, grid.rows, 1, max_directions);
  if (reads() && sink_->errors() == errors && grid.rows > max_directions / grid.columns)
    text.refuse(fmt::format("{}x{} directions; {} are allowed", grid.columns, grid.rows, max_directions));
  return text;
}

void JsonIo::yarn_counts(YarnCounts& counts, const FabricLimits& limits) const {
  whole(names::member::curves, counts.curves, 1, limits.curves);
  whole(names::member::nodes, counts.nodes, 2, limits.nodes);
  whole(names::member::stations, counts.stations, 1, limits.stations);
  whole(names::member::fields, counts.fields, min_yarn_fields, limits.fields);
  if (reads() && !has(names::member::values_per_station))
    counts.values = min_station_values;
  else
    whole(names::member::values_per_station, counts.values, min_station_values, limits.values);
}

}  // namespace selvedge
