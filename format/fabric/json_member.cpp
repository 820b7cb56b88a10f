#include "format/fabric/json_member.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "format/base/json_text.h"

namespace selvedge {

using nlohmann::json;

namespace {

Member of_type(Member member, json::value_t type, const char* type_name) {
  if (member && member.value->type() != type) {
    member.refuse(fmt::format("is not {}", type_name));
    member.value = nullptr;
  }
  return member;
}

}  // namespace

void Member::refuse(std::string message) const { sink->add(Code::fabric_member, place, std::move(message)); }

Member Member::require(const char* key) const {
  if (value == nullptr) return {};
  const auto found = value->find(key);
  Member member{nullptr, pointer_to(place, key), sink};
  if (found == value->end()) {
    member.refuse("is missing");
  } else {
    member.value = &*found;
  }
  return member;
}

Member Member::require_object(const char* key) const {
  return of_type(require(key), json::value_t::object, "an object");
}

Member Member::require_array(const char* key) const {
  return of_type(require(key), json::value_t::array, "an array");
}

std::array<Member, 2> Member::require_pair(const char* key) const {
  const Member list = require_array(key);
  const std::vector<Member> items = list.items();
  if (items.size() == 2) return {items[0], items[1]};
  if (list) list.refuse("does not have two items");
  return {};
}

std::vector<Member> Member::items() const {
  std::vector<Member> items;
  for (std::size_t i = 0; value != nullptr && i < value->size(); ++i) {
    items.push_back({&(*value)[i], fmt::format("{}/{}", place, i), sink});
  }
  return items;
}

std::optional<int> Member::whole_number(int min, int max) const {
  if (value == nullptr) return std::nullopt;
  if (!value->is_number_integer()) {
    refuse("is not a whole number");
  } else if (*value < min || *value > max) {
    refuse(fmt::format("{} is outside of {} to {}", value->dump(), min, max));
  } else {
    return value->get<int>();
  }
  return std::nullopt;
}

std::optional<float> Member::real_number(bool positive) const {
  if (value == nullptr) return std::nullopt;
  const double number = value->is_number() ? value->get<double>() : 0;
  if (!value->is_number()) {
    refuse("is not a number");
  } else if (std::abs(number) > static_cast<double>(std::numeric_limits<float>::max())) {
    refuse("is beyond single precision");
  } else if (positive && !(static_cast<float>(number) > 0)) {
    refuse(fmt::format("{} is not positive", value->dump()));
  } else {
    return static_cast<float>(number);
  }
  return std::nullopt;
}

void Member::warn_of_unknown_members(const std::vector<const char*>& known) const {
  if (value == nullptr) return;
  for (const auto& item : value->items()) {
    if (std::none_of(known.begin(), known.end(), [&](const char* k) { return item.key() == k; })) {
      sink->add(Code::fabric_advice, pointer_to(place, item.key()), "is not known and is ignored");
    }
  }
}

}  // namespace selvedge
