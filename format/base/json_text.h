// JSON from untrusted files: a limit of depth, no repeated members, line numbers in messages.
#pragma once

#include <exception>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "format/base/error.h"

namespace selvedge {

/// How deeply a JSON text nests how many members its largest object has, and how many values there
/// are, counted without parsing it.
struct JsonDemands {
  int nesting = 0;
  int members = 0;
  std::size_t values = 1;  ///< at least as many as there are
};

/// Stops counting once brackets nest deeper than `max_nesting`.
JsonDemands demands_of(std::string_view text, int max_nesting);

/// The JSON pointer of the first member that its object has twice: programs differ in which of the two they
/// read. Nothing if there is no such member before the end or the first syntax error.
std::optional<std::string> repeated_member(std::string_view text);

/// The result is_discarded() if the text is not JSON, begins with a byte order mark, repeats a member, or
/// nests deeper than 64. The limit makes recursion over the value safe.
nlohmann::json parse_json(std::string_view text);

/// "line 2, column 5" of a byte counted from 1, as nlohmann-json counts.
std::string line_of(std::string_view text, std::size_t byte);

/// The message of an exception, without nlohmann-json's number before it.
std::string reason_of(const std::exception& error);

/// The JSON pointer to the member `name` of the object at pointer `object`; escapes "/" and "~" of the name.
std::string pointer_to(const std::string& object, const std::string& name);

}  // namespace selvedge
