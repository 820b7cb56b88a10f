// The members of a JSON object, one call a member for reading, writing and checking: the call names the
// member, the variable that holds its value, and its rule.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "format/base/issue_sink.h"
#include "format/base/vec.h"

namespace selvedge {

enum class RealRule { any, not_negative, positive };

/// Reading: a missing member, another type or a broken rule adds FABRIC_MEMBER at its JSON pointer and leaves
/// the variable. Numbers are read in single precision, in which they must be finite. Writing: sets the
/// member.
class JsonIo {
 public:
  /// Of an object. `sink` must outlive it.
  static JsonIo reader(const nlohmann::json& object, IssueSink& sink) {
    return {&object, nullptr, {}, &sink};
  }
  static JsonIo writer(nlohmann::json& object) { return {nullptr, &object, {}, nullptr}; }

  bool reads() const { return to_ == nullptr; }
  /// False for a member that broke a rule when it was read; its members are then neither read nor written.
  explicit operator bool() const { return from_ != nullptr || to_ != nullptr; }
  bool has(const char* name) const { return from_ != nullptr && from_->contains(name); }
  /// Whether an optional member is to be read or written.
  bool optional(const char* name, bool written) const { return reads() ? has(name) : written; }
  /// The value that is read. Precondition: reads(), and it is not empty.
  const nlohmann::json& value() const { return *from_; }
  const std::string& place() const { return place_; }

  void whole(const char* name, int& value, int min, int max) const;
  void real(const char* name, float& value, RealRule rule = RealRule::any) const;
  void wholes(const char* name, int& first, int& second, int min, int max) const;
  void reals(const char* name, V2f& pair, RealRule rule) const;
  /// Whole numbers from 0 to `max`, at least one, increasing.
  void increasing(const char* name, std::vector<int>& list, int max) const;
  /// `count` strings.
  void texts(const char* name, std::vector<std::string>& list, std::size_t count) const;
  /// Writing: any value.
  void set(const char* name, nlohmann::json value) const { (*to_)[name] = std::move(value); }
  /// A member that is an object.
  JsonIo object(const char* name) const;

  /// Reading: the items of an array; none, with an issue, for another type.
  std::vector<JsonIo> items(const char* name) const;
  std::vector<JsonIo> items() const;
  /// Adds FABRIC_MEMBER here, or at a member.
  void refuse(std::string message) const;
  void refuse(const std::string& name, std::string message) const;
  IssueSink& sink() const { return *sink_; }

 private:
  JsonIo(const nlohmann::json* from, nlohmann::json* to, std::string place, IssueSink* sink)
      : from_(from), to_(to), place_(std::move(place)), sink_(sink) {}
  JsonIo member(const char* name) const;
  void read_whole(int& value, int min, int max) const;
  void read_real(float& value, RealRule rule) const;

  const nlohmann::json* from_;
  nlohmann::json* to_;
  std::string place_;
  IssueSink* sink_;
};

}  // namespace selvedge
