// The attribute text of a fabric file: a header as JSON and back (spec/fabric.md, "Attributes of part 0").
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "format/base/issue_sink.h"
#include "format/fabric/header.h"

namespace selvedge {

/// Equal headers give equal texts. A provenance that is not a JSON object is written as {}.
std::string header_to_json(const FabricHeader& header);

/// Parses the text of a file with our major version; else adds an error to the sink and returns nothing.
std::optional<nlohmann::json> parse_fabric_text(const std::string& text, IssueSink& sink);

/// Checks the members by all rules; places are JSON pointers. A layer that breaks a rule is left out of the
/// header. Nothing if texels, levels or views are invalid, since all else depends on them.
std::optional<FabricHeader> header_from_json(const nlohmann::json& text, const FabricLimits& limits,
                                             IssueSink& sink);

}  // namespace selvedge
