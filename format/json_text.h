// JSON as it stands in the attributes of our files: what the texts of fabrics and of samples share.
#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "format/directions.h"
#include "format/error.h"

namespace selvedge {

/// Watches a parser for members that stand twice in their object, which different programs read differently:
/// to be given to json::parse as its callback, by std::ref.
class MembersOnce {
 public:
  template <class AnyJson>
  bool operator()(int, nlohmann::json::parse_event_t event, const AnyJson& value) {
    using Event = nlohmann::json::parse_event_t;
    if (event == Event::object_start) open_objects_.emplace_back();
    if (event == Event::object_end) open_objects_.pop_back();
    if (event == Event::key) {
      broken_ = broken_ || !open_objects_.back().insert(value.template get<std::string>()).second;
    }
    return true;
  }
  bool broken() const { return broken_; }

 private:
  std::vector<std::set<std::string>> open_objects_;
  bool broken_ = false;
};

/// Parses a text of which nothing is known. is_discarded() where it is no JSON, begins with a byte order
/// mark, has a member twice, or nests deeper than 64: what walks through the value may then do so
/// recursively.
nlohmann::json parse_json(std::string_view text);

/// The JSON pointer to a member of the object that `object` points to; "/" and "~" of the name are escaped.
std::string pointer_to(const std::string& object, const std::string& name);

/// The JSON object that a provenance is; {} where it is none.
nlohmann::json provenance_json(const std::string& provenance);

/// `layout`, `columns` and `rows`.
nlohmann::json grid_json(const DirectionGrid& grid);

/// The inverse, for grids of 1 to `most` directions. FABRIC_UNSUPPORTED where the layout is unknown, else
/// FABRIC_MEMBER; the place is a JSON pointer from the grid on.
Result<DirectionGrid> grid_from(const nlohmann::json& grid, int most);

}  // namespace selvedge
