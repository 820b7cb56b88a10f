#include "format/json_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "format/fabric_names.h"

namespace selvedge {
namespace {

using nlohmann::json;

/// Stops at a member that its object has already.
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
  /// An array or an object that is open, and which of its values is being read.
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

/// What both of the functions below take.
Result<json> parse_checked(std::string_view text, const std::string& file) {
  constexpr int most_depth = 64;
  const auto refuse = [&](std::string place, std::string why) {
    return fail(Code::json_malformed, file, std::move(place), std::move(why));
  };
  // The parser would skip it.
  if (text.starts_with("\xEF\xBB\xBF")) return refuse("", "begins with a byte order mark");
  if (demands_of(text, most_depth).nesting > most_depth)
    return refuse("", fmt::format("is nested deeper than {} levels", most_depth));
  try {
    json parsed = json::parse(text);
    if (auto place = repeated_member(text)) return refuse(std::move(*place), "stands there twice");
    return parsed;
  } catch (const json::parse_error& error) {
    return refuse(line_of(text, error.byte),
                  error.byte > text.size() ? "the JSON is cut short" : "is not JSON");
  } catch (const json::out_of_range&) {
    return refuse("", "a number that is too large");
  }
}

}  // namespace

JsonDemands demands_of(std::string_view text, int deepest_wanted) {
  JsonDemands demands;
  std::vector<int> members;  ///< of the brackets that are open
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      members.push_back(0);
      demands.nesting = std::max(demands.nesting, static_cast<int>(members.size()));
      if (demands.nesting > deepest_wanted) return demands;
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
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t start = before.rfind('\n');
  const std::size_t column = before.size() - (start == std::string_view::npos ? 0 : start + 1) + 1;
  return fmt::format("line {}, column {}", line, column);
}

json parse_json(std::string_view text) {
  auto parsed = parse_checked(text, "");
  return parsed ? std::move(*parsed) : json(json::value_t::discarded);
}

Result<json> parse_json_object(std::string_view text, const std::string& file) {
  auto parsed = parse_checked(text, file);
  if (parsed && !parsed->is_object()) return fail(Code::json_malformed, file, "", "is not a JSON object");
  return parsed;
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

json provenance_json(const std::string& provenance) {
  json parsed = parse_json(provenance);
  return parsed.is_object() ? parsed : json::object();
}

json grid_json(const DirectionGrid& grid) {
  return {{names::member::layout, names::layout_equal_area},
          {names::member::columns, grid.columns},
          {names::member::rows, grid.rows}};
}

json whole_json(const WholeFabric& whole) {
  json text{{names::member::level, whole.level}, {names::member::texels, {whole.texels.x, whole.texels.y}}};
  if (whole.levels > 0) text[names::member::levels] = whole.levels;
  return text;
}

Result<DirectionGrid> grid_from(const json& grid, int most) {
  if (!grid.is_object()) return fail(Code::fabric_member, {}, {}, "is not an object");
  const std::string layout_place = std::string("/") + names::member::layout;
  const auto layout = grid.find(names::member::layout);
  if (layout == grid.end() || !layout->is_string()) {
    return fail(Code::fabric_member, {}, layout_place, "is missing or not a string");
  }
  if (*layout != names::layout_equal_area) {
    return fail(Code::fabric_unsupported, {}, layout_place, "is not a known layout");
  }
  DirectionGrid result;
  for (const auto& [name, value] :
       {std::pair{names::member::columns, &result.columns}, {names::member::rows, &result.rows}}) {
    const auto found = grid.find(name);
    if (found == grid.end() || !found->is_number_integer() || *found < 1 || *found > most) {
      return fail(Code::fabric_member, {}, std::string("/") + name,
                  fmt::format("is not a whole number from 1 to {}", most));
    }
    *value = found->get<int>();
  }
  if (result.rows > most / result.columns) {
    return fail(Code::fabric_member, {}, {},
                fmt::format("{}x{} directions; {} are allowed", result.columns, result.rows, most));
  }
  return result;
}

}  // namespace selvedge
