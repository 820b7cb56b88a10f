// The members of an attribute text, one call a member for reading, writing and checking: the call names the
// member, the variable that holds its value, and its rule.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "format/base/error.h"
#include "format/fabric/fabric.h"

namespace selvedge {

enum class RealRule { any, not_negative, positive };

/// Reading: a missing member, another type or a broken rule adds an issue at its JSON pointer and leaves the
/// variable. Numbers are read in single precision, in which they must be finite. Writing: sets the member.
class JsonIo {
 public:
  /// Reads an object; issues have this code. `sink` must outlive it.
  static JsonIo reader(const nlohmann::json& object, Code code, IssueSink& sink) {
    return {&object, nullptr, {}, code, &sink};
  }
  static JsonIo writer(nlohmann::json& object) { return {nullptr, &object, {}, {}, nullptr}; }

  bool is_reading() const { return to_ == nullptr; }
  /// False for a member that broke a rule when it was read; its members are then neither read nor written.
  explicit operator bool() const { return from_ != nullptr || to_ != nullptr; }
  bool input_has(const char* name) const { return from_ != nullptr && from_->contains(name); }
  /// Whether an optional member is to be read or written.
  bool has_optional(const char* name, bool written) const { return is_reading() ? input_has(name) : written; }
  /// The value that is read. Precondition: is_reading(), and it is not empty.
  const nlohmann::json& value() const { return *from_; }
  const std::string& json_pointer() const { return place_; }

  void integer(const char* name, int& value, int min, int max) const;
  void number(const char* name, float& value, RealRule rule = RealRule::any) const;
  void integer_pair(const char* name, int& first, int& second, int min, int max) const;
  void numbers(const char* name, std::span<float> values, RealRule rule = RealRule::any) const;
  /// Whole numbers from 0 to `max`, at least one, increasing.
  void increasing_integers(const char* name, std::vector<int>& list, int max) const;
  /// `count` strings.
  void strings(const char* name, std::vector<std::string>& list, std::size_t count) const;
  /// A grid of 1 to `max_directions` directions; FABRIC_UNSUPPORTED of a fabric with another layout. Returns
  /// its object.
  JsonIo grid(const char* name, DirectionGrid& grid,
              int max_directions) const;  // NOLINT(modernize-use-nodiscard)
  void yarn_counts(YarnCounts& counts, const FabricLimits& limits) const;
  /// Writing: any value.
  void set_member(const char* name, nlohmann::json value) const { (*to_)[name] = std::move(value); }
  /// Reading: a member of any type.
  JsonIo member(const char* name) const;
  /// A member that is an object.
  JsonIo object(const char* name) const;
  /// Reading: the items of an array; none, with an issue, for another type.
  std::vector<JsonIo> items(const char* name) const { return member(name).items(); }
  std::vector<JsonIo> items() const;
  /// Adds an issue here, or at a member.
  void add_issue(std::string message) const;
  void add_issue(const std::string& name, std::string message) const;
  IssueSink& sink() const { return *sink_; }

 private:
  JsonIo(const nlohmann::json* from, nlohmann::json* to, std::string place, Code code, IssueSink* sink)
      : from_(from), to_(to), place_(std::move(place)), code_(code), sink_(sink) {}
  void read_whole(int& value, int min, int max) const;
  void read_real(float& value, RealRule rule) const;
  /// The items of an array of this length; none for another.
  std::vector<JsonIo> items(const char* name, std::size_t count) const;

  const nlohmann::json* from_;
  nlohmann::json* to_;
  std::string place_;
  Code code_;
  IssueSink* sink_;
};

/// A provenance as a JSON object; {} if it is not one.
nlohmann::json provenance_json(const std::string& provenance);

/// Rounds to the digits of an fmt format. Parsed from text, so that 19.16 does not become 19.160000000000004.
nlohmann::json short_number(double value, const char* form = "{:.4g}");

}  // namespace selvedge
