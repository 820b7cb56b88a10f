// Parsing JSON of unknown origin: depth limit, duplicate members, line numbers in messages.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/base/error.h"

namespace selvedge {

/// How deep and wide a JSON text is, found without parsing it.
struct JsonDemands {
  int nesting = 0;
  int members = 0;  ///< of its largest object
};

/// Looks no further where the brackets nest deeper than `deepest_wanted`.
JsonDemands demands_of(std::string_view text, int deepest_wanted);

/// The JSON pointer of the first member that its object has a second time: programs differ in which of the
/// two they take. Nothing if there is none before the end, or before the place where it ceases to be JSON.
std::optional<std::string> repeated_member(std::string_view text);

/// Parses a text of unknown origin. is_discarded() where it is not JSON, begins with a byte order
/// mark, has a member twice, or nests deeper than 64: what walks through the value may then do so
/// recursively.
nlohmann::json parse_json(std::string_view text);

/// The same of a file's text that has to be an object; `file` is for messages. JSON_MALFORMED says which of
/// these it is, with the line and column where it ceases to be JSON, or with the member that is there twice.
Result<nlohmann::json> parse_json_object(std::string_view text, const std::string& file);

/// "line 2, column 5" of a byte counted from 1, as the parser does.
std::string line_of(std::string_view text, std::size_t byte);

/// The JSON pointer to a member of the object that `object` points to; "/" and "~" of the name are escaped.
std::string pointer_to(const std::string& object, const std::string& name);

}  // namespace selvedge
