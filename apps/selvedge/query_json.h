// The queries of spec/conformance, read from their JSON.
#pragma once

#include <nlohmann/json.hpp>

#include "apps/selvedge/closed_environment.h"

namespace selvedge {

/// JSON_MALFORMED: a member that is missing, of another form or out of range, which is the place; or none
/// ("").
tl::unexpected<Error> malformed(const char* place, const char* message);

/// `evaluate`. Other members are ignored.
Result<FabricQuery> query_from(const nlohmann::json& line);

/// `environment`, with view and axis turned into the fabric's frame.
Result<EnvironmentQuery> environment_query_from(const nlohmann::json& line);

}  // namespace selvedge
