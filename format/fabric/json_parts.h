// JSON members that the attribute texts of fabric files and samples files share.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace selvedge {

/// A provenance as a JSON object; {} if it is not one.
nlohmann::json provenance_json(const std::string& provenance);

/// Rounds to the digits of an fmt format. Parsed from text, so that 19.16 does not become 19.160000000000004.
nlohmann::json short_number(double value, const char* form = "{:.4g}");

}  // namespace selvedge
