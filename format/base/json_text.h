// JSON from untrusted files: a limit of depth, no repeated members, line numbers in messages.
#pragma once

#include <cstdint>
#include <exception>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "format/base/error.h"

namespace selvedge {

/// Limits of a JSON text, which end its parsing where they are passed.
struct JsonLimits {
  int nesting = 64;                               ///< of brackets; makes recursion over the value safe
  int members = std::numeric_limits<int>::max();  ///< of one object
  std::uint64_t values = std::numeric_limits<std::uint64_t>::max();
};

/// Why a JSON text was given up.
struct JsonFault {
  enum class Kind { nesting, members, values, repeated } kind = Kind::repeated;
  std::string
      place;  ///< JSON pointer of a member that its object has twice: programs differ in which they read
};

/// Parses in one pass, and takes its values from `limits`. Throws JsonFault, or nlohmann-json's exception for
/// what is not JSON.
nlohmann::json parse_json(std::string_view text, JsonLimits& limits);

/// The result is_discarded() if the text is not JSON, begins with a byte order mark, repeats a member, or
/// nests deeper than 64.
nlohmann::json parse_json(std::string_view text);

/// "line 2, column 5" of a byte counted from 1, as nlohmann-json counts.
std::string line_and_column(std::string_view text, std::size_t byte);

/// The message of an exception, without nlohmann-json's number before it.
std::string exception_message(const std::exception& error);

/// The JSON pointer to the member `name` of the object at pointer `object`; escapes "/" and "~" of the name.
std::string member_pointer(const std::string& object, const std::string& name);

}  // namespace selvedge
