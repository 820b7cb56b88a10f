#include "format/base/json_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <vector>

namespace selvedge {
namespace {

using nlohmann::json;

/// Builds a value, and counts what it has. (With a callback instead the library would look through an array
/// again after each of its objects.)
class JsonBuilder : public nlohmann::detail::json_sax_dom_parser<json> {
  using Base = nlohmann::detail::json_sax_dom_parser<json>;

 public:
  JsonBuilder(json& value, JsonLimits& limits) : Base(value), limits_(limits) {}

  bool null() { return add_value() && Base::null(); }
  bool boolean(bool value) { return add_value() && Base::boolean(value); }
  bool number_integer(std::int64_t value) { return add_value() && Base::number_integer(value); }
  bool number_unsigned(std::uint64_t value) { return add_value() && Base::number_unsigned(value); }
  bool number_float(double value, const std::string& text) {
    return add_value() && Base::number_float(value, text);
  }
  bool string(std::string& value) { return add_value() && Base::string(value); }
  bool start_object(std::size_t size) { return open(false) && Base::start_object(size); }
  bool start_array(std::size_t size) { return open(true) && Base::start_array(size); }
  bool key(std::string& name) {
    add_member(name);
    return Base::key(name);
  }
  bool end_object() {
    open_.pop_back();
    return Base::end_object();
  }
  bool end_array() {
    open_.pop_back();
    return Base::end_array();
  }

 private:
  /// An open array or object, and the value that is being read.
  struct Level {
    bool is_array = false;
    std::size_t count = 0;
    std::string step;
    std::set<std::string> members;
  };

  bool add_value() {
    if (limits_.values-- == 0) throw JsonFault{JsonFault::Kind::values, {}};
    if (!open_.empty()) ++open_.back().count;
    return true;
  }

  bool open(bool is_array) {
    add_value();
    open_.push_back({is_array, 0, {}, {}});
    if (static_cast<int>(open_.size()) > limits_.nesting) throw JsonFault{JsonFault::Kind::nesting, {}};
    return true;
  }

  void add_member(const std::string& name) {
    Level& object = open_.back();
    object.step = name;
    const bool is_new = object.members.insert(name).second;
    if (static_cast<int>(object.members.size()) > limits_.members)
      throw JsonFault{JsonFault::Kind::members, {}};
    if (is_new) return;
    std::string place;
    for (const Level& level : open_)
      place = member_pointer(place, level.is_array ? std::to_string(level.count - 1) : level.step);
    throw JsonFault{JsonFault::Kind::repeated, place};
  }

  JsonLimits& limits_;
  std::vector<Level> open_;
};

}  // namespace

json parse_json(std::string_view text, JsonLimits& limits) {
  json value;
  JsonBuilder builder(value, limits);
  json::sax_parse(text, &builder);
  return value;
}

json parse_json(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) return json::value_t::discarded;  // the parser would skip it
  try {
    JsonLimits limits;
    return parse_json(text, limits);
  } catch (const JsonFault&) {
    return json::value_t::discarded;
  } catch (const json::exception&) {
    return json::value_t::discarded;
  }
}

std::string line_and_column(std::string_view text, std::size_t byte) {
  const std::string_view before = text.substr(0, std::min(byte > 0 ? byte - 1 : 0, text.size()));
  const auto line = std::ranges::count(before, '\n') + 1;
  const std::size_t start = before.rfind('\n');
  const std::size_t column = before.size() - (start == std::string_view::npos ? 0 : start + 1) + 1;
  return fmt::format("line {}, column {}", line, column);
}

std::string exception_message(const std::exception& error) {
  const std::string_view what = error.what();
  // "[json.exception.type_error.302] type must be string, but is number"
  const std::size_t end = what.starts_with("[json.exception.") ? what.find("] ") : std::string_view::npos;
  return std::string(end == std::string_view::npos ? what : what.substr(end + 2));
}

std::string member_pointer(const std::string& object, const std::string& name) {
  std::string pointer = object + "/";
  for (const char c : name)
    if (c == '~')
      pointer += "~0";
    else if (c == '/')
      pointer += "~1";
    else
      pointer += c;
  return pointer;
}

}  // namespace selvedge
