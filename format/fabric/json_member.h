// A member of a JSON text that has to obey rules: reading it adds every broken one to a sink.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "format/base/issue_sink.h"

namespace selvedge {

/// Where a member is (a JSON pointer), and its value: null where it is missing or not what was asked for. All
/// functions of a member that is null give nothing and add nothing.
struct Member {
  const nlohmann::json* value = nullptr;
  std::string place;
  IssueSink* sink = nullptr;

  explicit operator bool() const { return value != nullptr; }

  /// Adds FABRIC_MEMBER with the member's place.
  void refuse(std::string message) const;

  /// Members of an object and items of an array. They have to be there, and of that type.
  Member require(const char* key) const;
  Member require_object(const char* key) const;
  Member require_array(const char* key) const;
  /// Both items of an array of two.
  std::array<Member, 2> require_pair(const char* key) const;
  std::vector<Member> items() const;

  bool has(const char* key) const { return value != nullptr && value->contains(key); }
  std::optional<int> whole_number(int min, int max) const;
  /// Rounded to single precision, in which it has to be finite and, if `positive`, above 0.
  std::optional<float> real_number(bool positive = false) const;

  /// Adds FABRIC_ADVICE for every member of an object that is not `known`.
  void advise_on_others(const std::vector<const char*>& known) const;
};

}  // namespace selvedge
