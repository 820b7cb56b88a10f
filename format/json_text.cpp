#include "format/json_text.h"

#include <fmt/format.h>

#include <functional>

#include "format/fabric_names.h"

namespace selvedge {
namespace {

using nlohmann::json;

bool nests_deeper(std::string_view text, int most) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > most) return true;
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return false;
}

}  // namespace

json parse_json(std::string_view text) {
  constexpr int most_depth = 64;
  if (text.starts_with("\xEF\xBB\xBF")) return json(json::value_t::discarded);  // the parser would skip it
  if (nests_deeper(text, most_depth)) return json(json::value_t::discarded);
  MembersOnce members;
  json parsed = json::parse(text, std::ref(members), false);
  return members.broken() ? json(json::value_t::discarded) : parsed;
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
