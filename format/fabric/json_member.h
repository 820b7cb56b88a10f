// Checked access to the members of a JSON text: every broken rule is added to a sink.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "format/base/issue_sink.h"

namespace selvedge {

/// A JSON value and its JSON pointer. `value` is null if the member is missing or has the wrong type; then
/// all functions return nothing and add no errors.
struct Member {
  const nlohmann::json* value = nullptr;
  std::string place;
  IssueSink* sink = nullptr;

  explicit operator bool() const { return value != nullptr; }

  /// Adds FABRIC_MEMBER at the member's place.
  void refuse(std::string message) const;

  /// Members of an object that must exist, with the type of the function's name.
  Member require(const char* key) const;
  Member require_object(const char* key) const;
  Member require_array(const char* key) const;
  /// The items of an array that must have two.
  std::array<Member, 2> require_pair(const char* key) const;
  std::vector<Member> items() const;

  bool has(const char* key) const { return value != nullptr && value->contains(key); }
  std::optional<int> whole_number(int min, int max) const;
  /// Rounded to single precision, in which it must be finite and, if `positive`, above 0.
  std::optional<float> real_number(bool positive = false) const;

  /// Adds FABRIC_ADVICE for every member of an object that is not in `known`.
  void warn_of_unknown_members(const std::vector<const char*>& known) const;
};

}  // namespace selvedge
