#include "format/fabric/json_parts.h"

#include <fmt/format.h>

#include "format/base/json_text.h"
#include "format/fabric/names.h"

namespace selvedge {

using nlohmann::json;

json provenance_json(const std::string& provenance) {
  json parsed = parse_json(provenance);
  return parsed.is_object() ? parsed : json::object();
}

json short_number(double value, const char* form) {
  return parse_json(fmt::format(fmt::runtime(form), value));
}

json grid_json(const DirectionGrid& grid) {
  return {{names::member::layout, names::layout_equal_area},
          {names::member::columns, grid.columns},
          {names::member::rows, grid.rows}};
}

Result<DirectionGrid> grid_from_json(const json& grid, int max_directions) {
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
    if (found == grid.end() || !found->is_number_integer() || *found < 1 || *found > max_directions) {
      return fail(Code::fabric_member, {}, std::string("/") + name,
                  fmt::format("is not a whole number from 1 to {}", max_directions));
    }
    *value = found->get<int>();
  }
  if (result.rows > max_directions / result.columns) {
    return fail(Code::fabric_member, {}, {},
                fmt::format("{}x{} directions; {} are allowed", result.columns, result.rows, max_directions));
  }
  return result;
}

}  // namespace selvedge
