#include "format/base/json_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>
#include <vector>

namespace selvedge {
namespace {

using nlohmann::json;

/// Follows a parser by its callback.
class JsonGuard {
 public:
  explicit JsonGuard(JsonLimits& limits) : limits_(limits) {}

  bool operator()(int /*depth*/, json::parse_event_t event, json& parsed) {
    using Event = json::parse_event_t;
    if (event == Event::object_end || event == Event::array_end) {
      open_.pop_back();
    } else if (event == Event::key) {
      add_member(parsed.get_ref<const std::string&>());
    } else {
      if (limits_.values-- == 0) throw JsonFault{JsonFault::Kind::values, {}};
      if (!open_.empty()) ++open_.back().count;
      if (event != Event::value) {
        open_.push_back({event == Event::array_start, 0, {}, {}});
        if (static_cast<int>(open_.size()) > limits_.nesting) throw JsonFault{JsonFault::Kind::nesting, {}};
      }
    }
    return true;
  }

 private:
  /// An open array or object, and the value that is being read.
  struct Level {
    bool is_array = false;
    std::size_t count = 0;
    std::string step;
    std::set<std::string> members;
  };

  void add_member(const std::string& name) {
    Level& object = open_.back();
    object.step = name;
    const bool is_new = object.members.insert(name).second;
    if (static_cast<int>(object.members.size()) > limits_.members)
      throw JsonFault{JsonFault::Kind::members, {}};
    if (is_new) return;
    std::string place;
    for (const Level& level : open_)
      place = pointer_to(place, level.is_array ? std::to_string(level.count - 1) : level.step);
    throw JsonFault{JsonFault::Kind::repeated, place};
  }

  JsonLimits& limits_;
  std::vector<Level> open_;
};

}  // namespace

json parse_json(std::string_view text, JsonLimits& limits) {
  JsonGuard guard(limits);
  return json::parse(text, std::ref(guard));
}

json parse_json(std::string_view text) {
  const json none(json::value_t::discarded);
  if (text.starts_with("\xEF\xBB\xBF")) return none;  // the parser would skip it
  try {
    JsonLimits limits;
    return parse_json(text, limits);
  } catch (const JsonFault&) {
    return none;
  } catch (const json::exception&) {
    return none;
  }
}

std::string line_of(std::string_view text, std::size_t byte) {
  const std::string_view before = text.substr(0, std::min(byte > 0 ? byte - 1 : 0, text.size()));
  const auto line = std::ranges::count(before, '\n') + 1;
  const std::size_t start = before.rfind('\n');
  const std::size_t column = before.size() - (start == std::string_view::npos ? 0 : start + 1) + 1;
  return fmt::format("line {}, column {}", line, column);
}

std::string reason_of(const std::exception& error) {
  const std::string_view what = error.what();
  // "[json.exception.type_error.302] type must be string, but is number"
  const std::size_t end = what.starts_with("[json.exception.") ? what.find("] ") : std::string_view::npos;
  return std::string(end == std::string_view::npos ? what : what.substr(end + 2));
}

std::string pointer_to(const std::string& object, const std::string& name) {
  std::string pointer = object + "/";
  for (const char c : name) {
    if (c == '~') {
      pointer += "~0";
    } else if (c == '/') {
      pointer += "~1";
    } else {
      pointer += c;
    }
  }
  return pointer;
}

}  // namespace selvedge
