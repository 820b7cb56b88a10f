#include "format/base/json_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace selvedge {
namespace {

using nlohmann::json;

/// Stops at the first member that its object has twice.
class RepetitionFinder : public nlohmann::json_sax<json> {
 public:
  std::optional<std::string> found;

  bool null() override { return step(); }
  bool boolean(bool) override { return step(); }
  bool number_integer(number_integer_t) override { return step(); }
  bool number_unsigned(number_unsigned_t) override { return step(); }
  bool number_float(number_float_t, const string_t&) override { return step(); }
  bool string(string_t&) override { return step(); }
  bool binary(binary_t&) override { return step(); }
  bool start_object(std::size_t) override { return open(false); }
  bool start_array(std::size_t) override { return open(true); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override {
    return false;
  }

  bool key(string_t& name) override {
    open_.back().step = name;
    if (open_.back().members.insert(name).second) return true;
    found.emplace();
    for (const Level& level : open_) {
      found = pointer_to(*found, level.is_array ? std::to_string(level.count - 1) : level.step);
    }
    return false;
  }

 private:
  /// An open array or object, and the value that is being read.
  struct Level {
    bool is_array = false;
    std::size_t count = 0;
    std::string step;
    std::set<std::string> members;
  };

  bool step() {
    if (!open_.empty()) ++open_.back().count;
    return true;
  }
  bool open(bool is_array) {
    step();
    open_.push_back({is_array, 0, {}, {}});
    return true;
  }
  bool close() {
    open_.pop_back();
    return true;
  }

  std::vector<Level> open_;
};

}  // namespace

JsonDemands demands_of(std::string_view text, int max_nesting) {
  JsonDemands demands;
  std::vector<int> members;  ///< by open bracket
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == ',') {
      ++demands.values;
    } else if (c == '{' || c == '[') {
      ++demands.values;
      members.push_back(0);
      demands.nesting = std::max(demands.nesting, static_cast<int>(members.size()));
      if (demands.nesting > max_nesting) return demands;
    } else if ((c == '}' || c == ']') && !members.empty()) {
      members.pop_back();
    } else if (c == ':' && !members.empty()) {
      demands.members = std::max(demands.members, ++members.back());
    }
  }
  return demands;
}

std::optional<std::string> repeated_member(std::string_view text) {
  RepetitionFinder finder;
  json::sax_parse(text, &finder);
  return std::move(finder.found);
}

std::string line_of(std::string_view text, std::size_t byte) {
  const std::string_view before = text.substr(0, std::min(byte > 0 ? byte - 1 : 0, text.size()));
  const auto line = std::ranges::count(before, '\n') + 1;
  const std::size_t start = before.rfind('\n');
  const std::size_t column = before.size() - (start == std::string_view::npos ? 0 : start + 1) + 1;
  return fmt::format("line {}, column {}", line, column);
}

json parse_json(std::string_view text) {
  constexpr int max_depth = 64;
  // The parser would skip a byte order mark.
  const bool sound = !text.starts_with("\xEF\xBB\xBF") && demands_of(text, max_depth).nesting <= max_depth;
  json parsed = sound ? json::parse(text, nullptr, false) : json(json::value_t::discarded);
  return parsed.is_discarded() || repeated_member(text) ? json(json::value_t::discarded) : parsed;
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
