// The attribute text of a fabric file: a header as JSON and back (spec/fabric.md, "Attributes of part 0").
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "format/base/issue_sink.h"
#include "format/fabric/header.h"

namespace selvedge {

/// The same header, the same text. A provenance that is no JSON object is written as {}.
std::string header_to_json(const FabricHeader& header);

/// The JSON object of a text of our major version; else nothing, and the sink says why.
std::optional<nlohmann::json> parse_fabric_text(const std::string& text, IssueSink& sink);

/// Every rule on the members, places being JSON pointers. A layer that breaks one is left out of the header;
/// nothing is given back where texels, levels or views are unknown, since all else depends on them.
std::optional<FabricHeader> header_from_json(const nlohmann::json& text, const FabricLimits& limits,
                                             IssueSink& sink);

}  // namespace selvedge
